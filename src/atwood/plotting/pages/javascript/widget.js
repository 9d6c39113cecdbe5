// A page as a widget of a notebook, by the protocol of anywidget: what is set goes to Python, and comes from there.
const PACE_MS = 100; // so often at most the time is told

export default {
  render({ model, el }) {
    const shadow = el.attachShadow({ mode: "open" }); // the styles of the notebook and of the page stay apart
    let [page, build, timer, applied] = [null, 0, null, {}];
    const send = (name, value) => {
      model.set(name, value);
      model.save_changes();
    };
    const tellTime = () => {
      timer ??= setTimeout(() => {
        timer = null;
        if (page) send("time", page.time);
      }, PACE_MS);
    };
    const settle = () => { // set what was set in Python
      if (!page.live) return;
      const wanted = model.get("settings");
      for (const path of new Set([...Object.keys(wanted), ...Object.keys(applied)])) {
        const value = wanted[path] ?? page.inputs.get(path)?.value;
        if (value !== (applied[path] ?? page.inputs.get(path)?.value)) page.put(path, value);
      }
      applied = { ...wanted };
    };
    const show = async () => {
      build += 1;
      const mine = build;
      page?.close();
      page = null;
      applied = {};
      const root = document.createElement("div");
      const style = document.createElement("style");
      root.id = "page";
      style.textContent = model.get("look");
      shadow.replaceChildren(style, root);
      try {
        const packets = model.get("packets");
        const packed = await unpackPage((id) => packets[id]);
        if (mine !== build) return; // another one came meanwhile
        const told = (settings) => {
          applied = settings === null ? {} : { ...applied, ...settings };
          send("settings", applied);
        };
        page = packed.start(packed.payload, packed.createEngine, packed.model, { root, told, moved: tellTime });
        settle();
      } catch (error) {
        root.append(`The viewer could not start: ${error.message}`);
        throw error;
      }
    };
    const changed = () => page && settle();
    model.on("change:packets", show);
    model.on("change:settings", changed);
    show();
    return () => {
      model.off("change:packets", show);
      model.off("change:settings", changed);
      clearTimeout(timer);
      build += 1;
      page?.close();
      page = null;
    };
  },
};
