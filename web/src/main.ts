// The page of `levelhead view`.
import { App } from "./app";
import { HttpSource } from "./source";

const source = new HttpSource(), about = source.call("about");
void new App(source, () => about).start();
