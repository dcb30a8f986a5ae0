"use strict";
// A view drawn anew in place: parts whose data did not change keep their nodes, and what a person has typed, opened,
// chosen or scrolled to stays. While a person types or holds the mouse down, a change from the server waits.
window.Workbench = window.Workbench || { views: {} };
(function (W) {
  // Parts of a view in their order, each [key, data, make, refresh]. A part stays the same node while its data are the
  // same; one with `refresh` is made once, and then told of each redraw.
  W.fillParts = function (place, parts) {
    const nodes = {};
    for (const child of [...place.children]) if (child.workbenchPart) nodes[child.workbenchPart] = child;
    const wished = parts.map(([key, data, make, refresh]) => {
      const text = JSON.stringify(data) ?? "", old = nodes[key];
      if (old && refresh) { refresh(old); return old; }
      if (old && old.workbenchData === text) return old;
      const node = make();
      node.workbenchPart = key; node.workbenchData = text;
      return node;
    });
    for (const child of [...place.childNodes]) if (!wished.includes(child)) child.remove();
    // A node that is put elsewhere loses focus and scroll: those that stand right are not touched.
    wished.forEach((node, i) => { if (place.childNodes[i] !== node) place.insertBefore(node, place.childNodes[i] || null); });
  };

  const nameOf = (node) => node.id || [node.tagName, node.dataset.step || node.getAttribute("aria-label") || node.getAttribute("href")
    || (node.querySelector("summary") || node).textContent.replace(/\d+/g, "#").slice(0, 80)].join(" ");
  const numbered = (nodes) => { // equal names are told apart by their order
    const counts = {};
    return nodes.map((node) => { const name = nameOf(node); counts[name] = (counts[name] || 0) + 1; return [`${name} ${counts[name]}`, node]; });
  };
  const detailsOf = (place) => numbered([...place.querySelectorAll("details")]);
  const controlsOf = (place) => numbered([...place.querySelectorAll("a, button, input, select, textarea, summary, pre, [tabindex]")]);
  const isTyped = (node) => node.matches("textarea, input:not([type=range]):not([type=checkbox]):not([type=file])");

  // The control that holds the focus, or the first in the window.
  function anchorOf(place, active) {
    const isSeen = ([, node]) => { const box = node.getBoundingClientRect(); return box.height > 0 && box.bottom > 0 && box.top < innerHeight; };
    const seen = controlsOf(place).filter(isSeen);
    return seen.find(([, node]) => node === active) || seen[0];
  }

  // What a person did to a view, and how it is put back after the view was drawn anew.
  W.keepPlace = function (place) {
    const opened = new Map(detailsOf(place).map(([name, node]) => [name, node.open]));
    const active = document.activeElement, controls = controlsOf(place);
    const focus = (controls.find(([, node]) => node === active) || [])[0];
    const typed = controls.filter(([, node]) => isTyped(node) && node.closest("[data-kept]") && node.value !== node.defaultValue).map(([name, node]) => [name, node.value]);
    const selection = focus && isTyped(active) ? [active.selectionStart, active.selectionEnd] : null;
    const scrolled = numbered([...place.querySelectorAll("[role=region], .wb-chain, pre")]).filter(([, node]) => node.scrollTop || node.scrollLeft)
      .map(([name, node]) => [name, node.scrollLeft, node.scrollTop]);
    const anchor = anchorOf(place, active), top = anchor && anchor[1].getBoundingClientRect().top, scroll = scrollY;
    return () => {
      for (const [name, node] of detailsOf(place)) if (opened.has(name) && node.open !== opened.get(name)) node.open = opened.get(name);
      const now = new Map(controlsOf(place));
      for (const [name, value] of typed) { const node = now.get(name); if (node && node.value !== value) node.value = value; }
      const node = focus && now.get(focus);
      if (node && node !== document.activeElement) {
        node.focus({ preventScroll: true });
        if (selection && isTyped(node)) node.setSelectionRange(...selection);
      }
      const regions = new Map(numbered([...place.querySelectorAll("[role=region], .wb-chain, pre")]));
      for (const [name, left, top] of scrolled) { const region = regions.get(name); if (region) { region.scrollLeft = left; region.scrollTop = top; } }
      // What a person looks at stays at its height, though what stands above it has grown.
      const same = anchor && (anchor[1].isConnected ? anchor[1] : now.get(anchor[0]));
      scrollTo({ left: scrollX, top: same ? scrollY + same.getBoundingClientRect().top - top : scroll, behavior: "instant" });
    };
  };

  // A place for words that outlast a redraw: what a person was told stays until the view is of something else.
  const kept = {};
  W.keptPlace = (name, make) => { if (!kept[name]) kept[name] = make(); return kept[name]; };

  let isPressed = false, waiting = null;
  const isTyping = () => {
    const node = document.activeElement, view = document.getElementById("view");
    return Boolean(node && view && view.contains(node) && isTyped(node) && !node.closest("[data-kept]"));
  };
  W.isHeld = () => isPressed || isTyping();
  W.isBehind = () => waiting !== null; // a change waits until the person is done
  // Do it now, or once the person has let go of the mouse and left the field.
  W.whenFree = function (act) {
    if (!W.isHeld()) { act(); return; }
    waiting = act;
    document.getElementById("wb-held").hidden = !isTyping();
  };
  const release = () => setTimeout(() => { // after the click or the change that this very event brings
    if (!waiting || W.isHeld()) return;
    const act = waiting;
    waiting = null;
    document.getElementById("wb-held").hidden = true;
    act();
  }, 0);
  window.addEventListener("pointerdown", (event) => { isPressed = Boolean(event.target.closest && event.target.closest("#view")); }, true);
  for (const name of ["pointerup", "pointercancel"]) window.addEventListener(name, () => { isPressed = false; release(); }, true);
  window.addEventListener("blur", () => { isPressed = false; release(); });
  window.addEventListener("focusout", release, true);
})(window.Workbench);
