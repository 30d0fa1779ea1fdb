// @ts-check
// An FMI 3.0 host for one FMU in WebAssembly. It knows FMI and nothing of linkages.

/** Status of FMI 3.0, section 2.2.3. */
export const STATUS = { OK: 0, WARNING: 1, DISCARD: 2, ERROR: 3, FATAL: 4 };

/** A call that the FMU did not carry out: `message` is what it says, without the function's name. */
export class Refusal extends Error {
  /** @param {number} status @param {string} message */
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

/** The FMU's module with its memory; instances are made from it. */
export class Fmu {
  /** Last messages by the number of the instance. @type {Map<number, string>} */
  messages = new Map();
  #instances = 0;

  /** @param {WebAssembly.Exports} exports @param {string} token */
  constructor(exports, token) {
    this.exports = /** @type {Record<string, (...given: number[]) => number>} */ (exports);
    this.memory = /** @type {WebAssembly.Memory} */ (exports.memory);
    this.token = token;
  }

  /**
   * Compile and start the module. Asynchronous, as browsers want it for modules of this size.
   * @param {BufferSource} bytes @param {string} token the instantiation token of the interface
   */
  static async load(bytes, token) {
    /** @type {Fmu | undefined} */
    let fmu;
    const page_log = (/** @type {number} */ owner, /** @type {number} */ _status, /** @type {number} */ text) =>
      fmu?.messages.set(owner, fmu.text(text));
    const { instance } = await WebAssembly.instantiate(bytes, { env: { page_log } });
    fmu = new Fmu(instance.exports, token);
    fmu.exports._initialize();
    return fmu;
  }

  /** Room in the FMU's memory, for good. @param {number} size in bytes */
  allocate(size) {
    return this.exports.malloc(size);
  }

  /** A C string, for good. @param {string} text */
  string(text) {
    const bytes = new TextEncoder().encode(`${text}\0`);
    const place = this.allocate(bytes.length);
    new Uint8Array(this.memory.buffer).set(bytes, place);
    return place;
  }

  /** The text of a C string. @param {number} place */
  text(place) {
    const bytes = new Uint8Array(this.memory.buffer, place);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }

  /** A Co-Simulation instance. @param {string} name */
  instance(name) {
    this.#instances += 1;
    const owner = this.#instances;
    const made = this.exports.fmi3InstantiateCoSimulation(
      this.string(name),
      this.string(this.token),
      0,
      0,
      1,
      0,
      0,
      0,
      0,
      owner,
      this.exports.page_logger(),
      0,
    );
    if (!made) throw new Refusal(STATUS.ERROR, this.messages.get(owner) ?? "no instance");
    return new Instance(this, made, owner);
  }

  /** Variables that are set or read together. @param {readonly number[]} references */
  block(references) {
    return new Block(this, references);
  }
}

/** Value references and room for their values, in the FMU's memory. */
export class Block {
  #view;

  /** @param {Fmu} fmu @param {readonly number[]} references */
  constructor(fmu, references) {
    this.fmu = fmu;
    this.count = references.length;
    this.references = fmu.allocate(4 * this.count + 8);
    this.values = fmu.allocate(8 * this.count + 8);
    this.#view = new Float64Array(0);
    new Uint32Array(fmu.memory.buffer, this.references, this.count).set(references);
  }

  /** The values as they are now: valid until the memory grows. */
  get view() {
    const { buffer } = this.fmu.memory;
    if (this.#view.buffer !== buffer) this.#view = new Float64Array(buffer, this.values, this.count);
    return this.#view;
  }
}

/** One instance. Its methods throw Refusal where the FMU says neither OK nor Warning. */
export class Instance {
  /** @param {Fmu} fmu @param {number} pointer @param {number} owner */
  constructor(fmu, pointer, owner) {
    this.fmu = fmu;
    this.pointer = pointer;
    this.owner = owner;
    this.step = fmu.allocate(16); // what fmi3DoStep tells: three Booleans and a time
  }

  /** @param {number} status */
  demand(status) {
    if (status <= STATUS.WARNING) return;
    const text = this.fmu.messages.get(this.owner) ?? `status ${status}`;
    throw new Refusal(status, text.slice(text.indexOf(": ") + 2));
  }

  /** Back to start values. */
  reset() {
    this.demand(this.fmu.exports.fmi3Reset(this.pointer));
    return this;
  }

  /** Into initialization mode, from time 0. */
  enter() {
    this.demand(this.fmu.exports.fmi3EnterInitializationMode(this.pointer, 0, 0, 0, 0, 0));
    return this;
  }

  /** From initialization mode to step mode. */
  exit() {
    this.demand(this.fmu.exports.fmi3ExitInitializationMode(this.pointer));
    return this;
  }

  /** Set the block's values. @param {Block} block */
  set(block) {
    this.demand(
      this.fmu.exports.fmi3SetFloat64(this.pointer, block.references, block.count, block.values, block.count),
    );
  }

  /** Read the block's values. @param {Block} block */
  get(block) {
    this.demand(
      this.fmu.exports.fmi3GetFloat64(this.pointer, block.references, block.count, block.values, block.count),
    );
    return block.view;
  }

  /** @param {number} reference @param {boolean} value */
  setBoolean(reference, value) {
    const place = this.fmu.allocate(8);
    new Uint32Array(this.fmu.memory.buffer, place, 1)[0] = reference;
    new Uint8Array(this.fmu.memory.buffer, place + 4, 1)[0] = Number(value);
    this.demand(this.fmu.exports.fmi3SetBoolean(this.pointer, place, 1, place + 4, 1));
    this.fmu.exports.free(place);
  }

  /**
   * The gradient, by the knowns, of the unknowns' sum weighted by `unknowns.values`; it is left in `knowns.values`.
   * @param {Block} unknowns @param {Block} knowns
   */
  adjoint(unknowns, knowns) {
    this.demand(
      this.fmu.exports.fmi3GetAdjointDerivative(
        this.pointer,
        unknowns.references,
        unknowns.count,
        knowns.references,
        knowns.count,
        unknowns.values,
        unknowns.count,
        knowns.values,
        knowns.count,
      ),
    );
    return knowns.view;
  }

  /** One communication step. @param {number} time @param {number} size */
  doStep(time, size) {
    const { step } = this;
    this.demand(this.fmu.exports.fmi3DoStep(this.pointer, time, size, 1, step, step + 1, step + 2, step + 8));
  }
}
