// What is done on the page waits in one line. Each thing goes to the server when the one before it was answered, so
// that nothing is computed of sliders that have moved since; of a slider in motion only the last place counts, and it
// goes once the pictures of the place before are drawn. The sliders and the pictures of an action are asked for at the
// same time, and either may be answered first.
(() => {
  const PATIENCE = 20000; // ms, for an answer that is lost
  const REST = 400; // ms
  const line = [];
  let serial = 0;
  let asked = 0;
  let drawing = 0;
  let settled = null;
  let resting = 0;

  const waitsFor = (since) => since > 0 && Date.now() - since < PATIENCE;

  const advance = () => {
    while (line.length) {
      const next = line[0];
      if (waitsFor(asked) || (next.kind === "move" && waitsFor(drawing))) {
        setTimeout(advance, PATIENCE);
        return;
      }
      line.shift();
      serial += 1;
      const data = { ...next, serial };
      if (next.kind === "write" || next.kind === "keep" || next.kind === "refine") {
        dash_clientside.set_props(`order-${next.kind}`, { data });
      } else {
        asked = drawing = Date.now();
        if (document.getElementById("status").textContent) dash_clientside.set_props("status", { children: "" });
        dash_clientside.set_props("action", { data });
      }
    }
  };

  const enqueue = (action) => {
    const last = line[line.length - 1];
    if (last && action.kind === "move" && last.kind === "move" && last.control === action.control) line.pop();
    line.push(action);
  };

  const ACTIONS = {
    slider: (control, value, state) =>
      Number(value) === state.order[control] ? null : { kind: "move", control, position: Number(value) },
    field: (control, value, state, said) =>
      value === state.texts[control] && !said[control] ? null : { kind: "field", control, text: String(value ?? "") },
    lock: (control) => ({ kind: "lock", control }),
    reset: (control) => ({ kind: "reset", control }),
  };

  // One call may tell of several things at once: a field that is left by pressing a button.
  const acted = (...given) => {
    const [state, said] = given.slice(-2);
    const name = document.getElementById("name").value;
    const told = dash_clientside.callback_context.triggered.filter(({ value }) => value !== null);
    const order = ({ prop_id }) => (prop_id.endsWith(".value") ? 0 : 1);
    for (const { prop_id, value } of told.sort((a, b) => order(a) - order(b))) {
      const id = prop_id.slice(0, prop_id.lastIndexOf("."));
      if (id.startsWith("{")) {
        const { control, part } = JSON.parse(id);
        const action = ACTIONS[part](control, value, state, said);
        if (action) enqueue(action);
      } else if (id === "wish") enqueue({ kind: "wish", ...value });
      else if (id === "keep" || id === "forget") enqueue({ kind: "keep", what: id });
      else if (id === "save" || id === "export" || id === "report") enqueue({ kind: "write", what: id, name });
      else enqueue({ kind: id });
    }
    advance();
  };

  const answered = (answer) => {
    asked = 0;
    if (!answer.changed) drawing = 0;
    advance();
  };

  const drawn = (what) => {
    drawing = 0;
    advance();
    const values = JSON.stringify(what.values);
    clearTimeout(resting);
    if (values === settled) return;
    resting = setTimeout(() => {
      settled = values;
      dash_clientside.set_props("settled", { data: values });
    }, REST);
  };

  const view = (told) => {
    if (told?.view) window.jointlibView(document.getElementById("machine-view"), told.view);
    return told?.said ?? "computing …";
  };

  window.dash_clientside = Object.assign({}, window.dash_clientside, { explorer: { acted, answered, drawn, view } });
})();
