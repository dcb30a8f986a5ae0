"use strict";
// Parts of every view: nodes, the answer with its doubts, tables, and the commands that give the same.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  W.make = function (tag, attributes, ...children) {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {})) {
      if (key === "text") node.textContent = value;
      else if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else if (value !== null && value !== undefined && value !== false) node.setAttribute(key, value === true ? "" : value);
    }
    node.append(...children.flat().filter((child) => child !== null && child !== undefined));
    return node;
  };

  // Base64 of little-endian 32-bit floats.
  W.floats = function (text) {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return new Float32Array(bytes.buffer);
  };

  W.number = function (value, digits = 4) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "–";
    if (value === 0) return "0";
    const size = Math.abs(value);
    return size >= 1e6 || size < 1e-3 ? value.toExponential(digits - 1).replace("e+", "e") : String(Number(value.toPrecision(digits)));
  };

  // A number with its 95 % half width, both to the same decimal; alone where the half width is not known.
  W.withInterval = function (value, halfWidth, unit) {
    if (!Number.isFinite(halfWidth) || halfWidth === null || halfWidth <= 0) return `${W.number(value)} ${unit}`;
    const decimals = Math.min(Math.max(1 - Math.floor(Math.log10(halfWidth)), 0), 6);
    return `${value.toFixed(decimals)} ±\u00a0${halfWidth.toFixed(decimals)}\u00a0${unit}`; // broken before the sign alone
  };

  W.age = function (seconds) {
    if (seconds === null || seconds === undefined) return "";
    for (const [size, key] of [[86400, "age.days"], [3600, "age.hours"], [60, "age.minutes"]])
      if (seconds >= size) return W.word(key, { n: Math.floor(seconds / size) });
    return W.word("age.now");
  };

  // The head of a view: its answer in a sentence, then what must be known before it is believed.
  W.head = function (view, title) {
    const answer = W.make("p", { class: "answer" + (view.is_stale ? " wb-old" : ""), ...W.spoken(view.answer), "aria-live": "polite" });
    return [W.make("h1", { text: title, tabindex: "-1" }), answer, W.doubts(view.doubts, 2)];
  };

  const SHOWN_DOUBTS = 3;
  W.doubts = function (doubts, level = 3) { // of the heading, for who hears the page
    const block = W.make("div", { class: "notes warning wb-doubts" });
    if (!doubts.length) { block.hidden = true; return block; }
    const lines = doubts.map((doubt) => W.make("li", { class: doubt.grave ? "wb-grave" : null, ...W.spoken(doubt.text || doubt) }));
    block.append(W.make("h3", { text: W.word("doubts"), "aria-level": level }), W.make("ul", {}, lines.slice(0, SHOWN_DOUBTS)));
    if (lines.length > SHOWN_DOUBTS)
      block.append(W.make("details", { class: "wb-more" }, W.make("summary", { text: W.word("more", { n: lines.length - SHOWN_DOUBTS }) }),
        W.make("ul", {}, lines.slice(SHOWN_DOUBTS))));
    return block;
  };

  // On paper nothing can be unfolded: every doubt is printed.
  let unfolded = [];
  window.addEventListener("beforeprint", () => { unfolded = [...document.querySelectorAll(".wb-doubts details:not([open])")]; for (const node of unfolded) node.open = true; });
  window.addEventListener("afterprint", () => { for (const node of unfolded) node.open = false; unfolded = []; });

  // Those that do not stand at the head of the view already, under whatever step's name.
  W.newDoubts = (view, doubts) => doubts.filter((text) => !view.doubts.some((doubt) => (doubt.text || doubt).endsWith(text)));

  W.section = function (title, ...children) {
    const node = W.make("section", {}, W.make("h2", { text: title }), children);
    for (const region of node.querySelectorAll(".table[data-unnamed]")) nameTable(region, title);
    return node;
  };
  function nameTable(region, name) {
    region.removeAttribute("data-unnamed");
    for (const part of [region, region.querySelector("table")]) part.setAttribute("aria-label", name);
  }

  // What a slider stands at, in words: its own number may be a logarithm, or in SI.
  W.sayValue = (slider, words) => slider.setAttribute("aria-valuetext", words);

  // An act that a button does once at a time. The button keeps the focus meanwhile, which a disabled one would lose.
  W.onceAtATime = (act) => async (event) => {
    const button = event.currentTarget;
    if (button.getAttribute("aria-disabled")) return;
    button.setAttribute("aria-disabled", "true");
    try { await act(event); } finally { button.removeAttribute("aria-disabled"); }
  };

  // What a shell and Python do for the same.
  W.same = function (view) {
    const box = W.make("details", { class: "wb-same", open: view.data && view.data.show_same ? "" : null },
      W.make("summary", { text: W.word("same") }));
    W.fillSame(box, view.commands, view.calls);
    return box;
  };
  W.fillSame = function (box, commands, calls) {
    while (box.children.length > 1) box.lastChild.remove();
    for (const [key, lines] of [["same.command", commands], ["same.python", calls]]) {
      if (!lines || !lines.length) continue;
      const text = lines.join("\n");
      box.append(W.make("h3", { text: W.word(key) }),
        W.make("div", { class: "wb-code" }, W.make("pre", { tabindex: "0", text }), W.copy(text)));
    }
  };
  W.copy = function (text) {
    return W.make("button", { type: "button", class: "wb-copy", text: W.word("copy"), onclick: async (event) => {
      await navigator.clipboard.writeText(text);
      event.target.textContent = W.word("copied");
    } });
  };

  const STACKED = 5; // columns from which a row is a block of lines on a phone: nothing of it lies beyond the edge
  // The roles say what the table is where its style makes blocks of the rows.
  W.table = function (head, rows, caption) {
    const cell = (value, i) => W.make("td", { role: "cell", "data-label": head[i] || null, class: typeof value === "number" ? "n" : null,
      ...(value instanceof Node ? {} : { text: typeof value === "number" ? W.number(value) : value }) }, ...(value instanceof Node ? [value] : []));
    return W.make("div", { class: "table" + (head.length >= STACKED ? " wb-stack" : ""), tabindex: "0", role: "region", "aria-label": caption || head.join(", "), "data-unnamed": !caption },
      W.make("table", { role: "table", "aria-label": caption || head.join(", ") }, caption ? W.make("caption", { text: caption }) : null,
        W.make("thead", { role: "rowgroup" }, W.make("tr", { role: "row" }, head.map((text) => W.make("th", { scope: "col", role: "columnheader", text })))),
        W.make("tbody", { role: "rowgroup" }, rows.map((row) => W.make("tr", { role: "row" }, row.map(cell))))));
  };

  // Samples between -1 and 1, played once; another sound ends the one before.
  let sounding = null;
  W.playSound = function (samples, rate) {
    const context = W.sounds || (W.sounds = new AudioContext()), buffer = context.createBuffer(1, samples.length, rate), source = context.createBufferSource();
    if (sounding) sounding.stop();
    buffer.copyToChannel(samples, 0);
    source.buffer = buffer;
    source.connect(context.destination);
    source.start();
    sounding = source; W.played = (W.played || 0) + 1;
  };

  W.fault = (error) => W.make("div", { class: "notes warning", role: "alert" }, W.make("h3", { text: W.word("fault") }),
    W.make("p", { class: "wb-fault", text: error.message || String(error) }));
})(window.Workbench);
