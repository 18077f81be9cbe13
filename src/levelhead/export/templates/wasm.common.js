const MARK = $mark; // of a saved state: this module and no other reads it
const PARAMETERS = $table; // group, name, kind, least, most; the ends belong to the range where true
const Numbers = $array;

async function compile(source) {
  if (source instanceof WebAssembly.Module) return source;
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return WebAssembly.compile(source);
  const url = new URL(source, import.meta.url);
  if (url.protocol === 'file:') {
    const { readFile } = await import(/* webpackIgnore: true */ /* @vite-ignore */ 'node:fs/promises');
    return WebAssembly.compile(await readFile(url));
  }
  const response = await fetch(url);
  if (!response.ok) throw new Error('cannot load ' + url + ': HTTP ' + response.status);
  return WebAssembly.compile(await response.arrayBuffer());
}

/** The memory of one instance: numbers at addresses, and room for many of them. */
class Memory {
  constructor(wasm) {
    this.wasm = wasm;
    this.reals = new Numbers(wasm.memory.buffer);
  }

  /** Numbers from an address on; a view, which growing memory ends. */
  at(address, count) {
    if (this.reals.length === 0) this.reals = new Numbers(this.wasm.memory.buffer);
    const first = address / Numbers.BYTES_PER_ELEMENT;
    return this.reals.subarray(first, first + count);
  }

  /** Addresses for arrays of so many bytes, behind each other. */
  room(sizes) {
    let end = this.wasm.__heap_base.value;
    const found = sizes.map((size) => {
      const address = Math.ceil(end / 16) * 16;
      end = address + size;
      return address;
    });
    const missing = end - this.wasm.memory.buffer.byteLength;
    if (missing > 0) this.wasm.memory.grow(Math.ceil(missing / 65536));
    return found;
  }
}

/** Parameters of a group as an object: reading and setting acts on the filter. */
function settings(wasm, group) {
  const found = {};
  PARAMETERS.forEach(([of, name, kind, low, lowIn, high, highIn], index) => {
    if (of !== group) return;
    const view = () => {
      const address = wasm.parameter(index);
      if (kind === 'int') return new Int32Array(wasm.memory.buffer, address, 1);
      if (kind === 'bool') return new Uint8Array(wasm.memory.buffer, address, 1);
      return new Numbers(wasm.memory.buffer, address, 1);
    };
    Object.defineProperty(found, name, {
      enumerable: true,
      get: () => (kind === 'bool' ? Boolean(view()[0]) : view()[0]),
      set: (value) => {
        const inside = (lowIn ? value >= low : value > low) && (highIn ? value <= high : value < high);
        if (kind === 'bool' ? typeof value !== 'boolean' : !(typeof value === 'number' && inside)) {
          throw new RangeError(name + ' = ' + value + ' is out of its range, ' + low + ' to ' + high);
        }
        view()[0] = value;
      },
    });
  });
  return Object.freeze(found);
}

/** The filter's memory behind a mark. */
function save(wasm) {
  const found = new Uint8Array(8 + wasm.size());
  found.set(MARK);
  found.set(new Uint8Array(wasm.memory.buffer, wasm.address(), wasm.size()), 8);
  return found;
}

function restore(wasm, bytes) {
  if (!(bytes instanceof Uint8Array) || bytes.length !== 8 + wasm.size() || MARK.some((one, i) => bytes[i] !== one)) {
    throw new TypeError('these bytes are not a state that this build of $name has saved');
  }
  new Uint8Array(wasm.memory.buffer, wasm.address(), wasm.size()).set(bytes.subarray(8));
}

function checkLength(name, array, count) {
  if (array.length !== count) {
    throw new TypeError(name + ' has ' + array.length + ' numbers; expected ' + count);
  }
}
