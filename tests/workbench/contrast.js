/* Texts whose contrast with what lies behind them is below that of WCAG 2.1 AA: 4.5, and 3 for large ones. */
() => {
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d", { willReadFrequently: true });
  canvas.width = canvas.height = 1;
  const colours = {}, kept = (text) => colours[text] || (colours[text] = rgba(text));
  const rgba = (text) => { // any notation of a colour
    context.clearRect(0, 0, 1, 1); context.fillStyle = text; context.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = (top, below) => [0, 1, 2].map((i) => top[i] * top[3] + below[i] * (1 - top[3]));
  const light = (c) => c.map((v) => v / 255).map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const lineage = (node) => { const list = []; for (let n = node; n && n.nodeType === 1; n = n.parentElement) list.unshift(n); return list; };
  // In a chart the box of a legend or a remark lies behind its text, drawn as a rectangle.
  const BOXED = ".annotation-text-g, .legend, .updatemenu-header-group, .updatemenu-button";
  const drawnBox = (node) => node.closest(BOXED) && node.closest(BOXED).querySelector("rect.bg, rect.updatemenu-item-rect");
  const fillOf = (node) => { const style = getComputedStyle(node), c = kept(style.fill); return [...c.slice(0, 3), c[3] * Number(style.fillOpacity)]; };
  const behind = (node) => { const box = drawnBox(node), ground = behindBoxes(node); return box ? over(fillOf(box), ground) : ground; };
  const behindBoxes = (node) => lineage(node).reduce((below, n) => {
    return over(kept(getComputedStyle(n).backgroundColor), below);
  }, rgba(getComputedStyle(document.documentElement).colorScheme.includes("dark") && matchMedia("(prefers-color-scheme: dark)").matches ? "#121212" : "#fff"));
  const faults = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const text = walker.currentNode.data.trim(), node = walker.currentNode.parentElement;
    if (!text || !node.checkVisibility({ opacityProperty: true, visibilityProperty: true }) || node.closest("[disabled], :disabled, [aria-disabled=true], script, style, [aria-hidden=true]")) continue;
    // What lies behind these is a coloured map, or a bar whose library chooses the ink for it.
    if (node.closest(".heatmaplayer, .contourlayer, .bartext-inside, .modebar, .hoverlayer")) continue;
    if (node.closest("select") && node.tagName === "OPTION") continue;
    const style = getComputedStyle(node), back = behind(node);
    const opacity = lineage(node).reduce((share, n) => share * Number(getComputedStyle(n).opacity), 1);
    const ink = node.namespaceURI.endsWith("svg") ? fillOf(node) : kept(style.color);
    const front = over([...ink.slice(0, 3), ink[3] * opacity], back), [a, b] = [light(front), light(back)].sort((x, y) => y - x);
    const ratio = (a + 0.05) / (b + 0.05), size = parseFloat(style.fontSize);
    const isLarge = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    if (ratio < (isLarge ? 3 : 4.5)) faults.push(`${ratio.toFixed(2)} ${node.tagName}.${node.getAttribute("class") || ""}: ${text.slice(0, 60)}`);
  }
  return [...new Set(faults)];
}
