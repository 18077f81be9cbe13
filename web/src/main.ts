// The page: which source, which charts, and how all parts follow one time.
import { App } from "./app";
import { HttpSource } from "./source";

new App(new HttpSource()).start();
