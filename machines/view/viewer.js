// A machine to turn with the mouse, and its mode shapes in motion. Draws on a canvas; asks the network for nothing.
// jointlibView(root, data) fills an element; called again with other data it keeps the view and the chosen mode.
(() => {
  "use strict";
  const LIGHT = [-0.35, -0.75, 0.55].map((x) => x / Math.hypot(0.35, 0.75, 0.55));
  const VIEWS = { aside: [35, 24], front: [0, 0], side: [90, 0], top: [0, 90] }; // degrees about up, and from above
  const PERIOD = 1600; // ms that a cycle is shown in
  const make = (tag, parent, props = {}) => Object.assign(parent.appendChild(document.createElement(tag)), props);

  const shade = (colour, bright) => {
    const part = (i) => Math.round(parseInt(colour.slice(i, i + 2), 16) * bright);
    return `rgb(${part(1)},${part(3)},${part(5)})`;
  };

  // Corners of every piece in m, displaced where a mode is shown.
  const displaced = (data, mode, phase, size) => {
    const c = Math.cos(phase) * size, s = Math.sin(phase) * size;
    const moved = mode && mode.moved.map((m) => [0, 1, 2, 3, 4, 5].map((i) => m[i] * c - m[i + 6] * s));
    return data.pieces.map(({ points }) => {
      const out = new Array(points.length / 4);
      for (let i = 0, k = 0; k < points.length; i += 1, k += 4) {
        const [f, x, y, z] = [points[k], points[k + 1], points[k + 2], points[k + 3]];
        if (!moved) { out[i] = [x, y, z]; continue; }
        const [ux, uy, uz, rx, ry, rz] = moved[f], o = data.frames[f];
        const a = x - o[0], b = y - o[1], d = z - o[2];
        out[i] = [x + ux + ry * d - rz * b, y + uy + rz * a - rx * d, z + uz + rx * b - ry * a];
      }
      return out;
    });
  };

  const build = (root) => {
    root.replaceChildren();
    root.classList.add("jv");
    const ui = {};
    const bar = make("div", root, { className: "jv-bar" });
    const pick = make("label", bar, { textContent: "mode " });
    ui.mode = make("select", pick);
    ui.play = make("button", bar, { type: "button", textContent: "Play" });
    const gain = make("label", bar, { textContent: "exaggeration " });
    ui.gain = make("input", gain, { type: "range", min: 0, max: 20, step: 0.5, value: 6 });
    ui.views = make("span", bar);
    for (const name of Object.keys(VIEWS)) {
      make("button", ui.views, { type: "button", textContent: name }).dataset.view = name;
    }
    const named = make("label", bar);
    ui.names = make("input", named, { type: "checkbox", checked: true });
    named.append(" names");
    ui.canvas = make("canvas", root, { tabIndex: 0 });
    ui.canvas.setAttribute("role", "img");
    ui.said = make("output", root, { className: "jv-said" });
    return ui;
  };

  window.jointlibView = (root, data, start = {}) => {
    if (root.jointlibView) return root.jointlibView.load(data);
    const ui = build(root), canvas = ui.canvas, pen = canvas.getContext("2d");
    const state = { turn: VIEWS.aside[0], tilt: VIEWS.aside[1], zoom: 1, phase: 0, playing: false };
    let drawn = [], hover = "", last = 0, pending = false;

    const modeOf = () => data.modes[Number(ui.mode.value) - 1];

    const axes = () => {
      const [right, into, up] = data.upright, t = (state.turn * Math.PI) / 180, e = (state.tilt * Math.PI) / 180;
      const mix = (...parts) => [0, 1, 2].map((i) => parts.reduce((sum, [share, v]) => sum + share * v[i], 0));
      const level = mix([Math.cos(t), into], [-Math.sin(t), right]);
      const aside = mix([Math.cos(t), right], [Math.sin(t), into]);
      return [aside, mix([Math.cos(e), level], [-Math.sin(e), up]), mix([Math.sin(e), level], [Math.cos(e), up])];
    };

    const paint = () => {
      pending = false;
      const wide = canvas.clientWidth, high = canvas.clientHeight, dense = window.devicePixelRatio || 1;
      if (!wide || !high) return;
      if (canvas.width !== Math.round(wide * dense) || canvas.height !== Math.round(high * dense)) {
        canvas.width = Math.round(wide * dense);
        canvas.height = Math.round(high * dense);
      }
      pen.setTransform(dense, 0, 0, dense, 0, 0);
      pen.clearRect(0, 0, wide, high);
      const look = axes(), scale = (state.zoom * 1.1 * Math.min(wide, high)) / data.size;
      const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const mid = look.map((axis) => dot(axis, data.centre));
      const seen = (p) => [
        wide / 2 + scale * (dot(look[0], p) - mid[0]), dot(look[1], p) - mid[1], high / 2 - scale * (dot(look[2], p) - mid[2]),
      ];
      const mode = modeOf();
      const corners = displaced(data, mode, state.phase, (Number(ui.gain.value) / 100) * data.size);
      const layers = [[], [], [], [], []];
      data.pieces.forEach((piece, number) => {
        const at = corners[number].map(seen);
        for (const face of piece.faces) {
          const [a, b, c] = [at[face[0]], at[face[1]], at[face[2]]];
          const u = [b[0] - a[0], scale * (b[1] - a[1]), a[2] - b[2]], v = [c[0] - a[0], scale * (c[1] - a[1]), a[2] - c[2]];
          const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
          const near = n[1] < 0;
          if (!near && !piece.glass) continue;
          const bright = 0.66 + 0.34 * Math.max(dot(n, LIGHT) / (Math.hypot(...n) || 1), 0);
          const depth = face.reduce((sum, i) => sum + at[i][1], 0) / face.length;
          layers[piece.glass ? (near ? 3 : 1) : 2].push({ piece, path: face.map((i) => at[i]), depth, bright, near });
        }
        const layer = piece.backdrop ? 0 : piece.glass ? 3 : !piece.faces.length && piece.width > 1.5 ? 4 : 2;
        for (const line of piece.lines) {
          const depth = line.reduce((sum, i) => sum + at[i][1], 0) / line.length;
          layers[layer].push({ piece, path: line.map((i) => at[i]), depth, line: true });
        }
        for (const i of piece.dots) layers[layer].push({ piece, path: [at[i]], depth: at[i][1], dot: true });
      });
      drawn = layers.flatMap((layer) => layer.sort((a, b) => b.depth - a.depth));
      for (const item of drawn) stroke(item);
      if (ui.names.checked) {
        const moved = mode && displaced({ frames: data.frames, pieces: data.labels }, mode, state.phase,
          (Number(ui.gain.value) / 100) * data.size);
        writeNames(data.labels.map((label, i) => ({ label, at: seen(moved ? moved[i][0] : label.points.slice(1)) })));
      }
      triad(look, high);
    };

    const stroke = ({ piece, path, bright, near, line, dot }) => {
      pen.beginPath();
      if (dot) pen.arc(path[0][0], path[0][2], 3.2, 0, 7);
      else path.forEach(([x, , y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      const chosen = hover && piece.name === hover;
      if (line) {
        pen.lineWidth = piece.width * (chosen ? 2 : 1);
        pen.globalAlpha = piece.glass ? 0.6 : 1;
        pen.strokeStyle = piece.colour;
        pen.stroke();
      } else {
        pen.closePath();
        pen.globalAlpha = piece.glass && !dot ? (near ? 0.13 : 0.08) * (chosen ? 2 : 1) : 1;
        pen.fillStyle = piece.glass || dot ? piece.colour : shade(piece.colour, bright * (chosen ? 1.15 : 1));
        pen.fill();
        if (!piece.glass && !dot) {
          pen.lineWidth = 0.5;
          pen.strokeStyle = pen.fillStyle;
          pen.stroke();
        }
      }
      pen.globalAlpha = 1;
    };

    const writeNames = (names) => {
      const taken = [];
      pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
      for (const { label, at: [x, , y] } of names) {
        const wide = pen.measureText(label.name).width;
        const spots = [[10, -8], [10, 16], [-10 - wide, -8], [-10 - wide, 16], [14, -26], [14, 34], [20, -44], [20, 52]]
          .map(([dx, dy]) => [x + dx, y + dy]);
        const clear = ([a, b]) => taken.every(([l, t, r]) => a > r || a + wide < l || Math.abs(b - t) > 15);
        const [a, b] = spots.find(clear) || spots[0];
        taken.push([a, b, a + wide]);
        pen.lineWidth = 0.6;
        pen.strokeStyle = label.colour;
        pen.beginPath();
        pen.moveTo(x, y);
        pen.lineTo(a > x ? a : a + wide, b - 4);
        pen.stroke();
        pen.lineWidth = 3;
        pen.strokeStyle = "#fff";
        pen.strokeText(label.name, a, b);
        pen.fillStyle = label.colour;
        pen.fillText(label.name, a, b);
      }
    };

    const triad = (look, high) => {
      pen.strokeStyle = pen.fillStyle = "#1b1f24";
      pen.lineWidth = 1.3;
      [..."xyz"].forEach((name, i) => {
        const a = look[0][i], b = look[2][i];
        pen.beginPath();
        pen.moveTo(48, high - 48);
        pen.lineTo(48 + 30 * a, high - 48 - 30 * b);
        pen.stroke();
        pen.fillText(name, 45 + 40 * a, high - 44 - 40 * b);
      });
    };

    const wish = () => {
      if (pending) return;
      pending = true;
      requestAnimationFrame(paint);
    };

    const beat = (now) => {
      if (!state.playing || !root.isConnected) return;
      state.phase = (state.phase + (2 * Math.PI * Math.min(now - last, 100)) / PERIOD) % (2 * Math.PI);
      last = now;
      paint();
      requestAnimationFrame(beat);
    };

    const play = (on) => {
      const begins = on && !state.playing;
      state.playing = on;
      ui.play.textContent = on ? "Stop" : "Play";
      if (begins) { last = performance.now(); requestAnimationFrame(beat); }
      wish();
    };

    const told = () => {
      const mode = modeOf();
      ui.play.disabled = ui.gain.disabled = !mode;
      ui.said.textContent = hover || (mode ? mode.says : "Drag to turn, scroll when focused to come nearer; point at a part for its name.");
    };

    const under = (x, y) => {
      for (let k = drawn.length - 1; k >= 0; k -= 1) {
        const { piece, path, line, dot } = drawn[k];
        if (piece.backdrop) continue;
        if (dot && Math.hypot(path[0][0] - x, path[0][2] - y) < 5) return piece.name;
        let inside = false;
        for (let i = 0, j = path.length - 1; i < path.length; j = i, i += 1) {
          const [ax, , ay] = path[i], [bx, , by] = path[j];
          if (line && i) {
            const long = Math.hypot(bx - ax, by - ay) || 1;
            const along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / long;
            if (along > -3 && along < long + 3 && Math.abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / long < 4) return piece.name;
          }
          if (!line && ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) inside = !inside;
        }
        if (inside && !dot) return piece.name;
      }
      return "";
    };

    canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener("pointermove", (e) => {
      if (e.buttons) {
        state.turn -= e.movementX * 0.4;
        state.tilt = Math.max(-90, Math.min(90, state.tilt + e.movementY * 0.4));
        wish();
        return;
      }
      const box = canvas.getBoundingClientRect(), found = under(e.clientX - box.left, e.clientY - box.top);
      if (found !== hover) { hover = found; told(); wish(); }
    });
    canvas.addEventListener("pointerleave", () => { hover = ""; told(); wish(); });
    canvas.addEventListener("wheel", (e) => {
      if (document.activeElement !== canvas) return;
      e.preventDefault();
      state.zoom = Math.max(0.3, Math.min(30, state.zoom * Math.exp(-e.deltaY * 0.0015)));
      wish();
    }, { passive: false });
    canvas.addEventListener("keydown", (e) => {
      const steps = { ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] };
      if (steps[e.key]) {
        state.turn += steps[e.key][0];
        state.tilt = Math.max(-90, Math.min(90, state.tilt + steps[e.key][1]));
      } else if (e.key === "+" || e.key === "-") state.zoom *= e.key === "+" ? 1.1 : 1 / 1.1;
      else return;
      e.preventDefault();
      wish();
    });
    ui.views.addEventListener("click", (e) => {
      if (!e.target.dataset.view) return;
      [state.turn, state.tilt] = VIEWS[e.target.dataset.view];
      state.zoom = 1;
      wish();
    });
    ui.mode.addEventListener("change", () => { state.phase = 0; told(); play(Boolean(modeOf())); });
    ui.play.addEventListener("click", () => play(!state.playing));
    ui.gain.addEventListener("input", wish);
    ui.names.addEventListener("change", wish);
    new ResizeObserver(wish).observe(canvas);

    const load = (now) => {
      const kept = ui.mode.value;
      data = now;
      ui.mode.replaceChildren(new Option("at rest", "0"), ...data.modes.map((m, i) => new Option(m.name, String(i + 1))));
      ui.mode.value = kept && Number(kept) <= data.modes.length ? kept : "0";
      ui.mode.disabled = !data.modes.length;
      canvas.setAttribute("aria-label", `${data.name}, drawn in three dimensions`);
      if (!modeOf()) play(false);
      told();
      wish();
    };
    root.jointlibView = { load, state };
    load(data);
    if (start.mode) { ui.mode.value = String(start.mode); told(); play(!window.matchMedia("(prefers-reduced-motion: reduce)").matches); }
  };
})();
