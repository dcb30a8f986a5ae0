"use strict";
// Chain of a project as a picture: steps in columns by what they rest on, lines between them; a column on a phone.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const SVG = "http://www.w3.org/2000/svg";

  function depths(steps, links) {
    const depth = Object.fromEntries(steps.map((step) => [step.name, 0]));
    for (const step of steps) // steps stand in an order in which each follows all that it rests on
      for (const [source, name] of links) if (name === step.name) depth[name] = Math.max(depth[name], depth[source] + 1);
    return depth;
  }

  // A line from one step to another is drawn only where no other way leads there.
  function direct(links) {
    const after = (name, seen = new Set()) => { for (const [a, b] of links) if (a === name && !seen.has(b)) { seen.add(b); after(b, seen); } return seen; };
    return links.filter(([a, b]) => !links.some(([c, d]) => c === a && d !== b && after(d).has(b)));
  }

  function box(step, act) {
    const state = step.state.replace(" ", "-");
    return W.make("button", { type: "button", class: `wb-step ${state}`, "data-step": step.name, onclick: () => act(step),
      "aria-label": `${step.name}: ${W.word("state." + state)}. ${step.words || step.does}` },
      W.make("b", { text: step.name }),
      W.make("span", { class: "wb-state", text: W.word("state." + state) + (step.age_s === null ? "" : " · " + W.age(step.age_s)) }),
      step.doubts.length ? W.make("span", { class: "wb-count", text: W.word(step.doubts.length > 1 ? "doubt.many" : "doubt.one", { n: step.doubts.length }) }) : null);
  }

  W.chainPicture = function (steps, links, act) {
    const depth = depths(steps, links), columns = Math.max(0, ...Object.values(depth)) + 1;
    const grid = W.make("div", { class: "wb-chain", role: "list", "aria-label": W.word("chain") });
    grid.style.setProperty("--columns", columns);
    const boxes = {};
    for (let column = 0; column < columns; column++)
      grid.append(W.make("div", { class: "wb-column" }, steps.filter((step) => depth[step.name] === column).map((step) => {
        boxes[step.name] = box(step, act);
        return W.make("div", { role: "listitem" }, boxes[step.name]);
      })));
    const lines = document.createElementNS(SVG, "svg");
    lines.setAttribute("class", "wb-links");
    lines.setAttribute("aria-hidden", "true");
    grid.prepend(lines);
    const draw = () => {
      const frame = grid.getBoundingClientRect();
      lines.setAttribute("viewBox", `0 0 ${frame.width} ${frame.height}`);
      lines.replaceChildren(...direct(links).map(([source, name]) => {
        const a = boxes[source].getBoundingClientRect(), b = boxes[name].getBoundingClientRect();
        const path = document.createElementNS(SVG, "path");
        const isRow = b.left > a.right;
        const [x0, y0, x1, y1] = isRow ? [a.right, a.top + a.height / 2, b.left, b.top + b.height / 2]
          : [a.left + 14, a.bottom, b.left + 14, b.top];
        const p = [x0 - frame.left, y0 - frame.top, x1 - frame.left, y1 - frame.top], bend = isRow ? (p[2] - p[0]) / 2 : 0;
        path.setAttribute("d", `M${p[0]} ${p[1]}C${p[0] + bend} ${p[1]} ${p[2] - bend} ${p[3]} ${p[2]} ${p[3]}`);
        return path;
      }));
    };
    new ResizeObserver(draw).observe(grid);
    return grid;
  };
})(window.Workbench);
