"use strict";
// Answers of a written workbench: of the states that were computed, the nearest, which is named.
(function () {
  const data = window.workbenchData;
  const distance = (state, body) => {
    let sum = 0, count = 0;
    for (const [path, value] of Object.entries({ ...body.values })) {
      const kept = state.values[path];
      sum += kept === undefined ? 100 : Math.abs(Math.log(value / kept));
      count += kept !== undefined;
    }
    for (const [axis, position] of Object.entries({ ...body.pose })) {
      if (state.pose[axis] === undefined) sum += Math.abs(position) > 1e-9 ? 100 : 0; else { sum += Math.abs(position - state.pose[axis]); count += 1; }
    }
    return sum + 200 * (Object.keys(state.values).length + Object.keys(state.pose).length - count);
  };
  function look(body) {
    const near = data.states.reduce((best, state) => distance(state, body) < distance(best, body) ? state : best);
    const words = [...Object.entries(near.values).map(([path, value]) => `${path} = ${value.toPrecision(5)}`),
      ...Object.entries(near.pose).map(([axis, position]) => `${axis} = ${position.toPrecision(4)}`)].join(", ");
    const moved = Object.keys(body.values || {}).length + Object.keys(body.pose || {}).length;
    const doubts = moved ? [`this page is a written one: what is drawn is the nearest state that was computed (${words || "the saved machine"}), one number changed at a time; open the project with toolpoint serve for any other`] : [];
    return { ...near.answer, mode: near.answer.mode, doubts: [...doubts, ...near.answer.doubts] };
  }
  function limit(body) {
    const cut = data.views.lobes.data.cuts.find((entry) => entry.name === body.cut), saved = Object.fromEntries(cut.sliders.map((slider) => [slider.key, slider.value]));
    const speeds = cut.speeds[1] - cut.speeds[0], asked = Object.entries(body.cut_values || {}).filter(([key]) => key in saved);
    // Where a number of the cut was moved it counts more than the speed: it was computed at one speed alone.
    const far = (state) => Math.abs(state.speed - body.speed) / speeds
      + 10 * Object.keys(saved).reduce((sum, key) => sum + Math.abs(Math.log(((body.cut_values || {})[key] ?? saved[key]) / (state.values[key] ?? saved[key]))), 0);
    const near = data.limits.filter((state) => state.cut === body.cut).reduce((best, state) => far(state) < far(best) ? state : best);
    const words = [`${Math.round(near.speed)} rev/min`, ...Object.entries(near.values).map(([key, value]) => {
      const { scale, unit } = cut.sliders.find((slider) => slider.key === key);
      return `${key} = ${Number((value / scale).toPrecision(4))} ${unit}`.trim();
    })].join(", ");
    const isSaved = !asked.some(([key, value]) => Math.abs(value / saved[key] - 1) > 1e-9) && near.speed === body.speed;
    return { ...near.limit, doubts: [...(isSaved ? [] : [`this page is a written one: what is drawn is the nearest state that was computed (${words}), one number changed at a time`]), ...near.limit.doubts] };
  }
  window.workbenchExport = {
    assets: data.words, pages: data.pages,
    async answer(path, body) {
      if (path === "view/list") return data.list;
      const view = /^view\/(\w+)/.exec(path);
      if (view) return data.views[view[1]];
      if (path === "machine/look") return look(body);
      if (path === "machine/limit") return limit(body);
      if (path === "machine/number") throw new Error("a typed number needs the server: toolpoint serve");
      throw new Error("this needs the server: toolpoint serve");
    },
  };
})();
