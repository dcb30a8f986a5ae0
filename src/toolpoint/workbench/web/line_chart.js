"use strict";
// Line chart in SVG: quick to draw anew while a slider moves, sharp in print. A screen reader hears its words with the ends of
// each line; the arrow keys walk along it, Enter takes a place where a click does.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  const SVG = "http://www.w3.org/2000/svg", MARGIN = { left: 58, right: 14, top: 12, bottom: 40 }, SAYING_DELAY = 400; // ms
  const svg = (tag, attributes, ...children) => {
    const node = document.createElementNS(SVG, tag);
    for (const [key, value] of Object.entries(attributes || {})) key === "text" ? node.textContent = value : node.setAttribute(key, value);
    node.append(...children);
    return node;
  };

  function niceTicks(low, high, count) {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw)), share = raw / power;
    const step = (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10) * power, ticks = [];
    for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) ticks.push(Number(value.toPrecision(12)));
    return ticks;
  }
  function logTicks(low, high) {
    const ticks = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++)
      for (const digit of high / low > 300 ? [1] : [1, 2, 5]) {
        const value = digit * 10 ** power;
        if (value >= low * 0.999 && value <= high * 1.001) ticks.push(value);
      }
    return ticks;
  }

  class LineChart {
    // settings: x, y (axis words), logX, logY, height, label (words for a screen reader), onpick(x, y)
    constructor(settings) {
      this.settings = { height: 300, ...settings };
      this.lines = []; this.bands = []; this.marks = []; this.range = {};
      this.root = svg("svg", { class: "wb-chart", role: settings.onpick ? "application" : "img", tabindex: "0", "aria-label": settings.label || "" });
      if (settings.onpick) this.root.setAttribute("aria-roledescription", W.word("chart")); // its arrow keys reach it
      this.readout = W.make("output", { class: "wb-readout", "aria-live": "off" });
      this.legend = W.make("div", { class: "wb-legend" });
      this.node = W.make("figure", { class: "wb-figure" }, this.legend, this.root, this.readout);
      this.observer = new ResizeObserver(() => this.draw());
      this.observer.observe(this.node);
      this.root.addEventListener("pointermove", (event) => this.point(event));
      this.root.addEventListener("pointerleave", () => { this.readout.textContent = ""; if (this.hair) this.hair.setAttribute("opacity", 0); });
      if (settings.onpick) this.root.addEventListener("click", (event) => {
        const [x, y] = this.place(event);
        settings.onpick(x, y);
      });
      this.root.addEventListener("keydown", (event) => this.walk(event));
    }

    // The words of the chart, and where each line is least and greatest.
    inWords() {
      const ends = this.lines.filter((line) => line.name && line.y.length).map((line) => {
        let low = 0, high = 0;
        for (let i = 1; i < line.y.length; i++) {
          if (line.y[i] < line.y[low]) low = i;
          if (Number.isFinite(line.y[i]) && !(line.y[i] <= line.y[high])) high = i;
        }
        return W.word("chart.line", { name: line.name, low: W.number(line.y[low]), at: W.number(line.x[low]), high: W.number(line.y[high]), there: W.number(line.x[high]), unit: this.settings.x });
      });
      const marks = this.marks.filter((mark) => mark.name && Number.isFinite(mark.y)).map((mark) => `${mark.name}: ${W.number(mark.y)} (${this.settings.x} ${W.number(mark.x)})`);
      return [this.words || this.settings.label || "", this.settings.y, ...ends, ...marks].filter(Boolean).join(". ");
    }

    walk(event) {
      const steps = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 };
      if (!this.sx) return;
      const { low, high } = this.sx, first = this.mine ?? (this.marks.find((mark) => Number.isFinite(mark.x)) || { x: low }).x;
      if (event.key in steps) this.mine = this.sx.back(this.sx(first) + steps[event.key] * (this.sx(high) - this.sx(low)) / 100);
      else if (event.key === "Home") this.mine = low;
      else if (event.key === "End") this.mine = high;
      else if (event.key === "Enter" && this.settings.onpick) {
        const line = this.lines.find((entry) => entry.x.length);
        this.settings.onpick(first, line ? line.y[this.nearest(line, first)] : 0);
        event.preventDefault(); return;
      } else return;
      event.preventDefault();
      this.mine = Math.min(Math.max(this.mine, low), high);
      this.readout.setAttribute("aria-live", "polite"); // a moving mouse would speak without end
      this.read(this.mine);
    }

    // lines: {x, y, name, kind}; bands: {x, low, high, name}; marks: {x, y, name, kind, low, high}
    set({ lines, bands, marks, range, label }) {
      if (lines) this.lines = lines;
      if (bands) this.bands = bands;
      if (marks) this.marks = marks;
      if (range) this.range = range;
      if (label) { this.words = label; this.root.setAttribute("aria-label", label); }
      this.draw();
    }

    ends() {
      let x0 = Infinity, x1 = -Infinity, y0 = Infinity, y1 = -Infinity;
      const { logY } = this.settings;
      const take = (x, y) => {
        if (x < x0) x0 = x;
        if (x > x1) x1 = x;
        if (Number.isFinite(y) && (!logY || y > 0)) { if (y < y0) y0 = y; if (y > y1) y1 = y; }
      };
      for (const line of this.lines) for (let i = 0; i < line.x.length; i++) take(line.x[i], line.y[i]);
      for (const band of this.bands) for (let i = 0; i < band.x.length; i++) { take(band.x[i], band.low[i]); take(band.x[i], band.high[i]); }
      for (const mark of this.marks) take(mark.x, mark.high && Number.isFinite(mark.high) ? mark.high : mark.y);
      const range = this.range;
      if (!logY) { y0 = range.y0 ?? Math.min(0, y0); y1 = range.y1 ?? y1 + 0.06 * (y1 - y0); }
      return [range.x0 ?? x0, range.x1 ?? x1, range.y0 ?? y0, range.y1 ?? y1];
    }

    scales() {
      const { logX, logY } = this.settings, [x0, x1, y0, y1] = this.ends(), w = this.width - MARGIN.left - MARGIN.right;
      const h = this.settings.height - MARGIN.top - MARGIN.bottom;
      const scale = (low, high, isLog, from, length) => {
        const f = isLog ? Math.log10 : (v) => v, a = f(low), b = f(high) - a || 1;
        const go = (v) => from + length * (f(v) - a) / b;
        go.back = (p) => { const v = a + b * (p - from) / length; return isLog ? 10 ** v : v; };
        go.low = low; go.high = high;
        return go;
      };
      this.sx = scale(x0, x1, logX, MARGIN.left, w);
      this.sy = scale(y0, y1, logY, MARGIN.top + h, -h);
    }

    draw() {
      this.width = this.node.clientWidth || this.width || 600;
      if (!this.lines.length && !this.bands.length) { this.root.replaceChildren(); return; }
      const { height, logX, logY } = this.settings;
      this.scales();
      this.root.setAttribute("viewBox", `0 0 ${this.width} ${height}`);
      this.root.setAttribute("height", height);
      const xs = logX ? logTicks(this.sx.low, this.sx.high) : niceTicks(this.sx.low, this.sx.high, Math.max(2, this.width / 120));
      const ys = logY ? logTicks(this.sy.low, this.sy.high) : niceTicks(this.sy.low, this.sy.high, 5);
      const content = [this.grid(xs, ys)];
      const clip = svg("g", { "clip-path": "none" });
      for (const band of this.bands) clip.append(svg("path", { class: "wb-band " + (band.kind || ""), d: this.bandPath(band) }));
      for (const line of this.lines) clip.append(svg("path", { class: "wb-line " + (line.kind || ""), d: this.linePath(line) }));
      for (const mark of this.marks) clip.append(...this.mark(mark));
      this.hair = svg("line", { class: "wb-hair", y1: MARGIN.top, y2: height - MARGIN.bottom, opacity: 0 });
      content.push(clip, this.hair);
      this.root.replaceChildren(...content);
      this.fillLegend();
      clearTimeout(this.saying); // when the sliders rest
      this.saying = setTimeout(() => this.root.setAttribute("aria-label", this.inWords()), SAYING_DELAY);
    }

    grid(xs, ys) {
      const group = svg("g", { class: "wb-grid" }), bottom = this.settings.height - MARGIN.bottom, right = this.width - MARGIN.right;
      let last = -Infinity;
      for (const x of xs) {
        const place = this.sx(x);
        group.append(svg("line", { x1: place, x2: place, y1: MARGIN.top, y2: bottom }));
        if (place - last < 38) continue;
        group.append(svg("text", { x: place, y: bottom + 16, "text-anchor": "middle", text: W.number(x) }));
        last = place;
      }
      last = Infinity;
      for (const y of ys) {
        const place = this.sy(y);
        group.append(svg("line", { x1: MARGIN.left, x2: right, y1: place, y2: place }));
        if (last - place < 13) continue;
        group.append(svg("text", { x: MARGIN.left - 6, y: place + 4, "text-anchor": "end", text: W.number(y, 3) }));
        last = place;
      }
      group.append(svg("text", { class: "wb-axis", x: (MARGIN.left + right) / 2, y: this.settings.height - 6, "text-anchor": "middle", text: this.settings.x }),
        svg("text", { class: "wb-axis", transform: `translate(13 ${(MARGIN.top + bottom) / 2}) rotate(-90)`, "text-anchor": "middle", text: this.settings.y }));
      return group;
    }

    linePath({ x, y }) {
      let path = "", isOn = false;
      const top = MARGIN.top;
      for (let i = 0; i < x.length; i++) {
        const value = y[i];
        if (!Number.isFinite(value) || (this.settings.logY && value <= 0)) { isOn = false; continue; }
        path += (isOn ? "L" : "M") + this.sx(x[i]).toFixed(1) + " " + Math.max(this.sy(value), top).toFixed(1);
        isOn = true;
      }
      return path;
    }

    bandPath({ x, low, high }) {
      const points = [], limit = (v) => Math.max(this.sy(Number.isFinite(v) ? v : this.sy.high), MARGIN.top).toFixed(1);
      for (let i = 0; i < x.length; i++) points.push(this.sx(x[i]).toFixed(1) + " " + limit(high[i]));
      for (let i = x.length - 1; i >= 0; i--) points.push(this.sx(x[i]).toFixed(1) + " " + limit(low[i]));
      return points.length ? "M" + points.join("L") + "Z" : "";
    }

    mark(mark) {
      const x = this.sx(mark.x), y = this.sy(Math.min(mark.y, this.sy.high)), nodes = [];
      if (mark.low !== undefined && mark.low !== null) {
        const high = Number.isFinite(mark.high) ? Math.max(this.sy(mark.high), MARGIN.top) : MARGIN.top;
        nodes.push(svg("line", { class: "wb-bar " + (mark.kind || ""), x1: x, x2: x, y1: this.sy(mark.low), y2: high }));
      }
      if (mark.kind === "interval") return nodes;
      if (mark.kind === "chatter") nodes.push(svg("path", { class: "wb-mark chatter", d: `M${x - 5} ${y - 5}l10 10m0-10l-10 10` }));
      else if (mark.kind === "above") nodes.push(svg("path", { class: "wb-mark above", d: `M${x - 6} ${y}h12M${x} ${y}v-14m-4 5l4 -5l4 5` }));
      else nodes.push(svg("circle", { class: "wb-mark " + (mark.kind || ""), cx: x, cy: y, r: 5.5 }));
      if (mark.name) nodes.push(svg("title", { text: mark.name }));
      return nodes;
    }

    fillLegend() {
      const entries = [...this.lines, ...this.bands, ...this.marks].filter((entry) => entry.name)
        .map((entry) => [entry.kind || "", entry.name, entry.low !== undefined && entry.x.length ? "band" : entry.y !== undefined && entry.y.length === undefined ? "mark" : "line"]);
      const key = JSON.stringify(entries);
      if (key === this.shownLegend) return;
      this.shownLegend = key;
      this.legend.replaceChildren(...entries.map(([kind, name, form]) =>
        W.make("span", {}, W.make("i", { class: `wb-key ${form} ${kind}` }), name)));
    }

    place(event) {
      const box = this.root.getBoundingClientRect(), share = this.width / box.width;
      return [this.sx.back((event.clientX - box.left) * share), this.sy.back((event.clientY - box.top) * share)];
    }

    point(event) {
      if (!this.sx) return;
      const [x] = this.place(event);
      this.readout.setAttribute("aria-live", "off");
      if (x >= this.sx.low && x <= this.sx.high) this.read(x);
    }

    nearest(line, x) {
      let near = 0;
      for (let i = 1; i < line.x.length; i++) if (Math.abs(line.x[i] - x) < Math.abs(line.x[near] - x)) near = i;
      return near;
    }

    read(x) {
      const words = this.lines.filter((line) => line.name).map((line) => {
        return `${line.name} ${W.number(line.y[this.nearest(line, x)])}`;
      });
      this.readout.textContent = `${this.settings.x} ${W.number(x)}: ${words.join(", ")}`;
      this.hair.setAttribute("x1", this.sx(x)); this.hair.setAttribute("x2", this.sx(x)); this.hair.setAttribute("opacity", 1);
    }
  }
  W.LineChart = LineChart;
})(window.Workbench);
