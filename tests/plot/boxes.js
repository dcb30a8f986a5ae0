// Measures a page: text beyond the screen, cut by its box, hidden by a scroll bar in print, or over other text.
(printed) => {
  const faults = [], width = document.documentElement.clientWidth, texts = [];
  const say = (kind, text, more) => faults.push(`${kind}: ${JSON.stringify(text.trim().slice(0, 60))} ${more || ""}`);
  if (document.documentElement.scrollWidth > width + 1) say("page wider than the screen", document.title, document.documentElement.scrollWidth + " > " + width);
  const shown = (e) => { for (let n = e; n; n = n.parentElement) { const s = getComputedStyle(n);
    if (s.display === "none" || s.visibility === "hidden" || Number(s.opacity) === 0) return false; } return true; };
  const scrolls = (e) => { for (let n = e; n && n !== document.body; n = n.parentElement) { const s = getComputedStyle(n);
    if (/(auto|scroll)/.test(s.overflowX + s.overflowY) && (n.scrollWidth > n.clientWidth + 1 || n.scrollHeight > n.clientHeight + 1)) return n; } return null; };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const text = node.textContent, e = node.parentElement;
    if (!text.trim() || /^(SCRIPT|STYLE|NOSCRIPT|OPTION|TITLE)$/.test(e.tagName) || !shown(e)) continue;
    if (e.closest(".modebar, .hoverlayer, .skip, details:not([open]) > pre")) continue;
    const range = document.createRange(); range.selectNodeContents(node);
    for (const r of e instanceof SVGElement ? [e.getBoundingClientRect()] : range.getClientRects()) {
      if (r.width < 1 || r.height < 1) continue;
      const box = { l: r.left, r: r.right, t: r.top + scrollY, b: r.bottom + scrollY, text, e };
      const scroller = scrolls(e);
      if (scroller && printed) { say("hidden by a scroll bar in print", text, scroller.className); break; }
      if (scroller) continue;
      texts.push(box);
      if (box.l < -1 || box.r > width + 1) { say("beyond the screen", text, `${box.l | 0}..${box.r | 0} of ${width}`); continue; }
      for (let n = e; n && n !== document.body; n = n.parentElement) {
        const s = getComputedStyle(n), outer = n.getBoundingClientRect();
        if (n instanceof SVGElement && n.tagName !== "svg") continue;
        if (s.overflowX !== "visible" || n.tagName === "svg") {
          if (r.left < outer.left - 1.5 || r.right > outer.right + 1.5 || r.top < outer.top - 1.5 || r.bottom > outer.bottom + 1.5) { say("cut", text, `${n.tagName}.${n.getAttribute("class")} by ${Math.max(outer.left - r.left, r.right - outer.right, outer.top - r.top, r.bottom - outer.bottom).toFixed(0)} px`); break; }
        }
      }
    }
  }
  texts.sort((a, b) => a.t - b.t);
  const corner = (e) => e instanceof SVGElement && e.closest("[transform*=rotate]") || (e instanceof SVGElement && /rotate\((?!0[,)])/.test(e.getAttribute("transform") || ""));
  for (let i = 0; i < texts.length; i++) for (let j = i + 1; j < texts.length && texts[j].t < texts[i].b - 2; j++) {
    const a = texts[i], b = texts[j];
    if (a.e === b.e || a.e.contains(b.e) || b.e.contains(a.e)) continue;
    const w = Math.min(a.r, b.r) - Math.max(a.l, b.l), h = Math.min(a.b, b.b) - Math.max(a.t, b.t);
    if (w > 2 && h > 3) {
      const slanted = [a, b].some((k) => { const m = k.e.getScreenCTM && k.e.getScreenCTM(); return m && Math.abs(m.b) > 0.05 && Math.abs(m.a) > 0.05; });
      if (!slanted) say("overlap", a.text, `${JSON.stringify(b.text.trim().slice(0, 40))} ${w.toFixed(0)} x ${h.toFixed(0)} px`);
    }
  }
  return faults;
}
