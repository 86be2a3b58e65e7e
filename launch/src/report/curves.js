// Curves over time: all have the same moment and the same span.

const DASHES = ["", "7 4", "2 3", "9 3 2 3", "14 4"];

// The numbers beside all curves. They are laid out anew, which takes longer than the rest of a frame: ten times a second are enough to read.
const tellers = [];
let due = 0;
function tell(at_once) {
  if (!at_once) { due ||= setTimeout(tell, 100, true); return; }
  clearTimeout(due);
  due = 0;
  for (const teller of tellers) teller();
}

/** Round steps, about `count` of them, from `low` to `high`. */
function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(factor => factor * power >= rough);
  const all = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) all.push(Number((k * step).toPrecision(12)));
  return all;
}

/** A chart at the end of `home`. */
function chart(of, home) {
  const times = floats(of.times);
  const curves = of.curves.map(({ name, values }, k) => {
    const [colour, dash] = [`var(--c${k % 4})`, DASHES[(k + Math.floor(k / 20)) % 5]];
    const stroke = { fill: "none", stroke: colour, "stroke-dasharray": dash, "stroke-width": 1.6, "stroke-linejoin": "round" };
    const output = make("output", {}, "");
    const button = make("button", { type: "button", "aria-pressed": true },
      make("svg", { viewBox: "0 0 32 8", "aria-hidden": true }, make("path", { d: "M0 4H32", ...stroke })), name, output);
    return { values: floats(values), path: make("path", stroke), output, button };
  });
  // What is less than this is a rounding error; numbers of things are whole.
  const all = curves.map(({ values }) => values), noise = 1e-9 * all.reduce((most, of) => of.reduce((most, value) => Math.max(most, Math.abs(value) || 0), most), 0);
  const whole = all.every(values => values.every(Number.isInteger));
  const measured = of.unit === "1" ? "" : ` [${of.unit}]`;
  const svg = make("svg", { tabindex: 0, role: "img", "aria-label": `${of.title}${measured} over time: ${of.curves.map(c => c.name).join(", ")}` });
  // The moment is no part of the picture: it moves in each frame, and nothing is laid out anew for it.
  const now = make("div", { class: "now" });
  home.append(make("figure", {}, make("figcaption", {}, of.title + measured), make("div", { class: "chart" }, svg, now),
    make("div", { class: "legend", role: "group", "aria-label": "Curves" }, ...curves.map(curve => curve.button))));
  const [left, right, top, bottom] = [52, 10, 8, 24];
  let [width, height] = [0, 230], beside = -1;
  const x = time => left + (time - view.from) / (view.to - view.from) * (width - left - right);
  const band = make("rect", { class: "band", y: top, height: height - top - bottom, width: 0 });

  /** The least and the largest value in each column of the picture, as a line. */
  function path(values, first, last, y) {
    let d = "", pen = "M", column = null, low, high, begin, end;
    const close = () => {
      if (column === null) return;
      d += `${pen}${column} ${y(begin)}${low < high ? `L${column} ${y(low)}L${column} ${y(high)}L${column} ${y(end)}` : ""}`;
      pen = "L";
    };
    for (let k = first; k <= last; k++) {
      const at = Number.isFinite(values[k]) ? Math.round(2 * x(times[k])) / 2 : null;
      if (at !== column) { close(); column = at; low = high = begin = values[k]; }
      // Where there is no number, there is no line.
      if (at === null) { pen = "M"; continue; }
      [low, high, end] = [Math.min(low, values[k]), Math.max(high, values[k]), values[k]];
    }
    close();
    return d;
  }
  function draw() {
    // Letters on paper are to be as large as those beside them.
    width = printed ? 340 : Math.max(svg.clientWidth || 480, 240);
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const [first, last] = [Math.max(place(times, view.from) - 1, 0), place(times, view.to)];
    const seen = curves.filter(curve => curve.button.ariaPressed !== "false");
    let [low, high] = [Infinity, -Infinity];
    for (const { values } of seen) for (let k = first; k <= last; k++) {
      if (values[k] < low) low = values[k];
      if (values[k] > high) high = values[k];
    }
    if (!(low <= high)) [low, high] = [0, 1];
    // What hardly changes is seen against 0.
    if (low > 0 && (low < 0.4 * high || high - low < 1e-3 * high)) low = 0;
    if (high < 0 && (high > 0.4 * low || high - low < -1e-3 * low)) high = 0;
    if (high === low) [low, high] = [-1, 1];
    const room = 0.04 * (high - low);
    const y = value => (top + (high + room - value) / (high - low + 2 * room) * (height - top - bottom)).toFixed(1);
    const axes = ticks(low, high, 5).filter(value => !whole || Number.isInteger(value)).flatMap(value => [
      make("line", { class: "axis", x1: left, x2: width - right, y1: y(value), y2: y(value) }),
      make("text", { x: left - 6, y: Number(y(value)) + 4, "text-anchor": "end" }, shown(value, 6))]);
    for (const value of ticks(view.from, view.to, Math.max(width / 90, 2))) axes.push(
      make("line", { class: "axis", x1: x(value), x2: x(value), y1: top, y2: height - bottom }),
      make("text", { x: Math.min(x(value), width - right - 14), y: height - 7, "text-anchor": "middle" }, `${shown(value, 7)} s`));
    for (const curve of seen) curve.path.setAttribute("d", path(curve.values, first, last, y));
    svg.replaceChildren(...axes, band, ...seen.map(curve => curve.path));
    point();
  }
  function point() {
    now.style.transform = `translateX(${100 * Math.min(Math.max(x(view.time), left), width - right) / width}%)`;
    tell();
  }
  tellers.push(() => {
    const row = place(times, view.time - 1e-9);
    if (row === beside) return;
    beside = row;
    for (const curve of curves) curve.output.firstChild.data = shown(Math.abs(curve.values[row]) < noise ? 0 : curve.values[row]);
  });
  const time = event => {
    const box = svg.getBoundingClientRect();
    const share = ((event.clientX - box.left) * width / box.width - left) / (width - left - right);
    return view.from + Math.min(Math.max(share, 0), 1) * (view.to - view.from);
  };
  let begin = null;
  svg.addEventListener("pointerdown", event => { begin = time(event); svg.setPointerCapture(event.pointerId); });
  svg.addEventListener("pointermove", event => {
    show({ time: time(event) });
    if (begin === null) return;
    const [from, to] = [x(begin), x(view.time)];
    band.setAttribute("x", Math.min(from, to));
    band.setAttribute("width", Math.abs(to - from));
  });
  svg.addEventListener("pointerup", event => {
    const [from, to] = [Math.min(begin, time(event)), Math.max(begin, time(event))];
    if (begin !== null && x(to) - x(from) > 6) show({ from, to });
    begin = null;
    band.setAttribute("width", 0);
  });
  svg.addEventListener("dblclick", () => show({ from: view.whole[0], to: view.whole[1] }));
  svg.addEventListener("keydown", event => pressed(event, (view.to - view.from) / 200));
  for (const { button } of curves) button.addEventListener("click", () => { button.ariaPressed = String(button.ariaPressed === "false"); draw(); });
  for (const event of ["beforeprint", "afterprint"]) window.addEventListener(event, draw);
  view.watchers.push(change => "from" in change ? draw() : point());
  new ResizeObserver(() => requestAnimationFrame(() => !printed && svg.clientWidth && Math.abs(svg.clientWidth - width) > 1 && draw())).observe(svg);
}

const curves = document.getElementById("curves");
if (curves) {
  const spans = data.charts.map(of => floats(of.times));
  view.whole = [Math.min(...spans.map(times => times[0])), Math.max(...spans.map(times => times.at(-1)))];
  const grid = make("div", { class: "grid" });
  curves.append(make("p", { class: "note screen" }, "Drag across a curve to zoom all of them, double-click to see all again. Arrow keys move the moment, + and - zoom, 0 shows all."), grid);
  for (const of of data.charts) chart(of, grid);
  // They are drawn when all of them stand there, each in its own width.
  show({ time: data.replay?.peak?.time ?? view.whole[0], from: view.whole[0], to: view.whole[1] });
}
