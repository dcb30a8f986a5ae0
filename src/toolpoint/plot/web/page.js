"use strict";
// Starts the charts and views of a page. Data are read from inert JSON blocks; nothing is fetched.
(function () {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const config = { responsive: true, displaylogo: false, showEditInChartStudio: false, showSendToCloud: false,
    modeBarButtonsToRemove: ["lasso2d", "select2d"], toImageButtonOptions: { format: "svg" } };
  const PAPER_WIDTH = 680; // px between the margins of A4
  window.toolpointCharts = {};

  function colours(layout, isDark) {
    const grid = isDark ? "rgba(190,200,220,0.16)" : "rgba(90,100,120,0.18)";
    const change = { "font.color": isDark ? "#dfe4ee" : "#2a3140", "hoverlabel.bgcolor": isDark ? "#232a37" : "#ffffff",
      "hoverlabel.font.color": isDark ? "#eef1f7" : "#1d2330" };
    for (const key of Object.keys(layout)) if (/^[xy]axis\d*$/.test(key)) change[key + ".gridcolor"] = grid;
    return change;
  }

  function clicked(event, view) {
    const data = event.points[0].customdata, mode = Array.isArray(data) ? data[0] === "mode" ? NaN : Number(data[0]) : Number(data);
    const target = window.toolpointViews && window.toolpointViews[view];
    if (target && Number.isInteger(mode) && mode >= 0 && mode < target.buttons.length) target.showMode(mode);
  }

  // Curves computed beforehand, one set for each point of another chart: a click there shows the point's own.
  function shown(root, all, number) {
    const one = all.sets[number];
    const traces = all.names.map((name, k) => ({ x: one.x, y: one.y[k], name, mode: all.mode,
      line: { width: 1.5, color: all.colours[k] }, marker: { size: 6, color: all.colours[k] } }));
    const heading = root.parentElement.querySelector(".tp-title")
      || root.parentElement.insertBefore(Object.assign(document.createElement("h3"), { className: "tp-title" }), root);
    heading.textContent = one.label;
    window.Plotly.react(root, traces, root.layout, config);
    root.dataset.shown = String(number);
  }

  function series(root) {
    const all = JSON.parse(window.ToolpointText(root.dataset.series));
    const source = window.toolpointCharts[root.dataset.follows];
    if (source) source.on("plotly_click", (event) => {
      const data = event.points[0].customdata, number = Number(Array.isArray(data) ? data[0] : data);
      if (event.points[0].data.name === all.trace && Number.isInteger(number) && all.sets[number]) shown(root, all, number);
    });
    const list = document.getElementById(root.dataset.series + "-list");
    if (list) list.addEventListener("change", () => shown(root, all, Number(list.value)));
    shown(root, all, 0);
  }

  function chart(root) {
    const { data, layout } = JSON.parse(window.ToolpointText(root.dataset.source));
    root.replaceChildren();
    window.Plotly.newPlot(root, data, layout, config).then(() => {
      window.Plotly.relayout(root, colours(root._fullLayout, dark.matches));
      if (root.dataset.clickView) root.on("plotly_click", (event) => clicked(event, root.dataset.clickView));
      window.toolpointCharts[root.dataset.name] = root;
      document.querySelectorAll(".tp-chart[data-series]").forEach((one) => {
        const ready = window.toolpointCharts[one.dataset.name] && (!one.dataset.follows || window.toolpointCharts[one.dataset.follows]);
        if (ready && !one.dataset.shown) series(one);
      });
      if (window.toolpointPick) window.toolpointPick();
    });
    // Before a chart is drawn there is nothing to recolour, and it begins in the colours of then.
    const recolour = (on, more) => root._fullLayout && window.Plotly.relayout(root, { ...colours(root._fullLayout, on), ...more });
    dark.addEventListener("change", () => recolour(dark.matches));
    // A chart drawn for a wide window would be cut at the edge of the paper.
    window.addEventListener("beforeprint", () => recolour(false, { autosize: false, width: PAPER_WIDTH }));
    window.addEventListener("afterprint", () => recolour(dark.matches, { autosize: true, width: null }));
  }

  // The chart library lies deflated in the page; the policy knows it by its SHA-256.
  function library() {
    const text = window.ToolpointText("tp-library");
    if (!text) return;
    const script = document.createElement("script");
    script.textContent = text;
    document.head.append(script);
    document.getElementById("tp-library").remove();
  }

  // Three digits, rounded down: never more than is stable.
  const down = (v) => { const step = 10 ** (Math.floor(Math.log10(v)) - 2); return Number((Math.floor(v / step + 1e-9) * step).toPrecision(3)); };

  // The answer at two further numbers for which values were computed: exact in both, or those of the neighbours side by side.
  function tabled(root, table, x, ratio, unit, inverseWords) {
    const row = Number(root.querySelector(".tp-row").value), column = Number(root.querySelector(".tp-column").value);
    if (row === table.starts[0] && column === table.starts[1]) return null;
    const names = table.labels, remedy = table.remedy.replace("{0}", row).replace("{1}", column), rows = table.rows;
    if (!(row > 0) || !(column > 0)) return [`Write ${names[0]} and ${names[1]} above zero.`];
    const k = table.columns.indexOf(column);
    if (k < 0) return [`${column} ${names[1]} were not computed (${table.columns.join(", ")} ${table.columns.length > 1 ? "were" : "was"}).`, remedy];
    if (row < rows[0] || row > rows.at(-1)) return [`The ${names[0]} ${row} ${rows.length > 1 ? `is outside what was computed: ${rows[0]} to ${rows.at(-1)}` : `was not computed (${rows[0]} was)`}.`, remedy];
    const high = Math.max(table.at.findIndex((v) => v >= x), 0), low = table.at[high] === x ? high : Math.max(high - 1, 0);
    const upperRow = rows.findIndex((v) => v >= row), places = rows[upperRow] === row ? [upperRow] : [upperRow - 1, upperRow];
    const size = (i) => {
      const [a, b] = [low, high].map((j) => table.values[i][k][j]).map((v) => v === null ? Infinity : v), value = Math.min(a, b);
      return Number.isFinite(value) ? `stable up to ${down(table.factor * value * ratio)} ${table.valueUnit}` : `no limit found up to ${down(table.factor * table.upper[i][k] * ratio)} ${table.valueUnit}`;
    };
    const head = `${x} ${unit}, ${column} ${column === 1 ? "tooth" : "teeth"}`, first = names[0][0].toUpperCase() + names[0].slice(1);
    const said = places.length === 1 ? [`${head}, ${names[0]} ${row}: ${size(places[0])}.`]
      : [`${head}: ${names[0]} ${rows[places[0]]} is ${size(places[0])}, ${rows[places[1]]} ${size(places[1])}.`, `${first} ${row} itself was not computed, and its limit may lie outside the two. ${remedy}`];
    return [...said, table.words, ...(inverseWords ? [inverseWords] : [])];
  }

  // A field for a number and its answer; between two places the lower answer counts, and both are named.
  function lookup(root) {
    const { at, values, answers, unit, inverse, table } = JSON.parse(window.ToolpointText(root.dataset.source));
    const field = root.querySelector("input"), place = root.querySelector("output");
    const lines = (...texts) => place.replaceChildren(...texts.map((text, i) =>
      Object.assign(document.createElement(i ? "small" : "strong"), { textContent: text })));
    const answer = () => {
      const x = Number(field.value), last = at.length - 1;
      if (field.value === "" || !Number.isFinite(x)) return lines("Write a number.");
      if (x < at[0] || x > at[last]) return lines(`Outside what was computed: ${at[0]} to ${at[last]} ${unit}.`);
      const high = at.findIndex((v) => v >= x), low = at[high] === x ? high : high - 1;
      const second = inverse && root.querySelector(".tp-inverse"), k = second ? Number(second.value) : 0;
      if (second && !(k > 0)) return lines(`Write ${inverse.label} above zero.`);
      const ratio = second ? inverse.start / k : 1, other = table && tabled(root, table, x, ratio, unit, ratio === 1 ? "" : `${inverse.label.replace("_", "")} ${k} ${inverse.unit}: ${inverse.words}`);
      if (other) return lines(...other);
      if (second && k !== inverse.start) { // exact where the rule holds
        const near = [low, high].filter((i) => at[i] !== undefined).map((i) => values[i] === null ? Infinity : values[i]), value = Math.min(...near);
        const size = down(inverse.factor * (Number.isFinite(value) ? value : inverse.upper) * inverse.start / k);
        return lines(`${x} ${unit} at ${inverse.label.replace("_", "")} ${k} ${inverse.unit}: ${Number.isFinite(value) ? `stable up to ${size}` : `no limit found up to ${size}`} ${inverse.valueUnit}.`,
          inverse.words, `As charted, ${inverse.label.replace("_", "")} ${inverse.start}: ${answers[near.indexOf(value) === 0 ? low : high]}`);
      }
      if (low === high) return lines(answers[high]);
      const size = (k) => values[k] === null ? Infinity : values[k], lower = size(low) <= size(high) ? low : high;
      return lines(answers[lower], `The lower of the two computed beside it. ${answers[low === lower ? high : low]}`);
    };
    for (const input of root.querySelectorAll("input")) input.addEventListener("input", answer);
    answer();
  }

  if (window.toolpointStart) window.toolpointStart();
  library();
  document.querySelectorAll(".tp-lookup[data-source]").forEach(lookup);
  document.querySelectorAll(".tp-chart[data-source]").forEach(chart);
})();
