// Calls of a page to its worker, and the worker's answers.
import type { Block } from "./block";

export interface LogFile { name: string; bytes: ArrayBuffer }
export interface Call { id: number; name: string; args: Record<string, unknown>; file?: LogFile }
export interface Answer { id: number; block?: Block; failure?: string }

/** Answers the calls of the page one after the other, as they came. */
export function serve(answer: (call: Call) => Promise<Block>): void {
  let last: Promise<void> = Promise.resolve();
  self.onmessage = ({ data }: MessageEvent<Call>) => {
    last = last.then(async () => {
      const found: Answer = { id: data.id };
      try {
        found.block = await answer(data);
      } catch (error) {
        found.failure = String((error as Error).message).trim().split("\n").at(-1);
      }
      self.postMessage(found, { transfer: found.block?.bytes === undefined ? [] : [found.block.bytes] });
    });
  };
}
