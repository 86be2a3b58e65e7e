// What curves, pictures and replay share: the data, and one moment and one span of time for all of them.

const data = JSON.parse(document.getElementById("data").textContent);
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
const floats = text => new Float32Array(bytes(text));

/** An element with attributes and children. */
function make(name, attributes = {}, ...children) {
  const svg = ["svg", "path", "line", "text", "rect", "circle"].includes(name);
  const it = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) it.setAttribute(key, value);
  it.append(...children);
  return it;
}

/** A number of so many digits; where it is small with a power of ten, as in the tables. */
function shown(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const of = Number(value.toPrecision(digits));
  return of && Math.abs(of) < 1e-4 ? of.toExponential() : String(of);
}

const view = { time: 0, from: 0, to: 1, whole: [0, 1], watchers: [] };
/** Show this moment [s], and what is given of the span, everywhere. */
function show(change) {
  Object.assign(view, change);
  view.time = Math.min(Math.max(view.time, view.whole[0]), view.whole[1]);
  for (const watcher of view.watchers) watcher(change);
}
/** Zoom about the moment that is shown: the span is `factor` times as long. */
function zoom(factor) {
  const half = factor * (view.to - view.from) / 2;
  const [from, to] = [Math.max(view.time - half, view.whole[0]), Math.min(view.time + half, view.whole[1])];
  if (to - from > 1e-7) show({ from, to });
}
/** The first of ascending `values` that is not below `value`; the last where there is none. */
function place(values, value) {
  let [low, high] = [0, values.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}
/** Keys that all of them know; true where it was one. */
function pressed(event, step) {
  const keys = {
    ArrowLeft: () => show({ time: view.time - step }), ArrowRight: () => show({ time: view.time + step }),
    Home: () => show({ time: view.whole[0] }), End: () => show({ time: view.whole[1] }),
    "+": () => zoom(0.5), "-": () => zoom(2), 0: () => show({ from: view.whole[0], to: view.whole[1] }),
  };
  const key = !event.ctrlKey && !event.metaKey && keys[event.key];
  if (key) { key(); event.preventDefault(); }
  return Boolean(key);
}
let printed = false;
window.addEventListener("beforeprint", () => { printed = true; });
window.addEventListener("afterprint", () => { printed = false; });
document.addEventListener("click", event => {
  const button = event.target.closest("button[data-time]");
  if (button) show({ time: Number(button.dataset.time) });
});
// What a script cannot do stands in the page.
window.addEventListener("error", event => document.body.prepend(make("p", { class: "alarm failed" }, `This page is not complete: ${event.message}`)));
