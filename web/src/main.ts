// The page of `levelhead view`.
import { App } from "./app";
import { HttpSource } from "./source";

const source = new HttpSource();
new App(source, source.call("about")).start();
