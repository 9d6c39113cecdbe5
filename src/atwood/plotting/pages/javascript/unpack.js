// What a page is packed from; `find` returns the text of one of its packets.
const unpackPage = async (find) => {
  const unpack = async (id) => {
    const bytes = Uint8Array.from(atob(find(id)), (c) => c.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  };
  const text = async (id) => new TextDecoder().decode(await unpack(id));
  const urls = {};
  const add = (modules) => {
    for (const [name, source] of Object.entries(modules)) { // each after those that it imports
      const resolved = source.replace(/from\s*"\.\/([\w.-]+)\.js"/g, (_, other) => `from "${urls[other]}"`);
      urls[name] = URL.createObjectURL(new Blob([resolved], { type: "text/javascript" }));
    }
  };
  if (!window.atwoodThree) { // once in a document, whatever it shows
    add(JSON.parse(await text("library")));
    window.atwoodThree ??= urls.three;
  }
  urls.three = window.atwoodThree;
  add(JSON.parse(await text("modules")));
  const numbers = await unpack("numbers");
  const types = { f4: Float32Array, f8: Float64Array, i4: Int32Array };
  const array = ({ $: type, at, count, row }) => { // of each row the first bytes of its numbers come first
    const made = new types[type](count);
    const [from, to, width] = [new Uint8Array(numbers, at), new Uint8Array(made.buffer), made.BYTES_PER_ELEMENT];
    for (let o = 0; o < count * width; o += row * width) {
      for (let b = 0; b < width; b += 1) for (let k = 0; k < row; k += 1) to[o + k * width + b] = from[o + b * row + k];
    }
    return made;
  };
  const payload = JSON.parse(await text("payload"), (key, value) => (value && value.$ ? array(value) : value));
  const { start } = await import(urls.page);
  const engine = urls.engine ? await import(urls.engine) : {};
  const model = urls.model ? (await import(urls.model)).model : null;
  return { start, payload, createEngine: engine.createEngine, model };
};
