// Where a page's data come from: the server of `levelhead view`, or a worker with Python in this browser.
import { parseBlock, type Block } from "./block";

export interface Parameter {
  name: string; unit: string; doc: string; range: string; value: number | boolean | null; default: number | boolean | null;
  switch: boolean; low: number; high: number; log: boolean;
}
export interface Filter { name: string; parameters: Parameter[] }
export interface HealthName { bit: number; words: string; fault: boolean }
export interface About {
  kind: "recording" | "node" | "guide"; title: string; samples?: number; clock?: boolean; filter?: Filter;
  second?: Filter | null; filters?: { name: string; doc: string }[]; health: HealthName[]; notes?: string[]; suffixes?: string[]; starts?: string[];
}
export interface NodeState {
  valid: boolean; words: string[]; failure?: string; seq?: number; stamp?: number; age?: number | null;
  offset?: number | null; uncertainty?: number | null; filter?: Filter; source?: string;
  record?: { path: string; rows: number; failure: string };
  guide?: { words: string; fraction: number; done: boolean; notes: string[]; quat?: [number, number, number, number] | null };
}
export interface NodeEvent { t: number; name: string; text: string; on: boolean; fault: boolean }

/** Answers calls with blocks; a live one also streams them. */
export interface Source {
  call(name: string, args?: object): Promise<Block>;
  stream(take: (block: Block) => void, lost: () => void): void;
}

/** The server from which this page was loaded. */
export class HttpSource implements Source {
  async call(name: string, args: object = {}): Promise<Block> {
    let answer: Response;
    try {
      answer = await fetch(`call/${name}`, {
        method: "POST", body: JSON.stringify(args), headers: { "Content-Type": "application/json" },
      });
    } catch {
      throw new Error("levelhead does not answer: the command that opened this page has ended");
    }
    const block = parseBlock(await answer.arrayBuffer());
    if (block.header.error !== undefined) throw new Error(block.header.error);
    return block;
  }

  async stream(take: (block: Block) => void, lost: () => void): Promise<void> {
    try {
      const answer = await fetch("stream");
      const reader = answer.body!.getReader();
      let waiting = new Uint8Array(0);
      for (;;) {
        const { done, value } = await reader.read();
        if (done) break;
        const joined = new Uint8Array(waiting.length + value.length);
        joined.set(waiting);
        joined.set(value, waiting.length);
        let place = 0;
        while (joined.length - place >= 4) {
          const length = new DataView(joined.buffer, place, 4).getUint32(0, true);
          if (joined.length - place - 4 < length) break;
          take(parseBlock(joined.buffer.slice(place + 4, place + 4 + length)));
          place += 4 + length;
        }
        waiting = joined.slice(place);
      }
    } catch { /* the server is gone */ }
    lost();
    setTimeout(() => this.stream(take, lost), 1000);
  }
}
