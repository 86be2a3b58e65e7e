// Where rocks cross a line, seen along their way: place along it and height of the centre above the ground, coloured by energy.

for (const home of document.querySelectorAll("[data-hits]")) {
  const of = (data.hits ?? []).find(({ line }) => line === home.dataset.hits);
  if (!of) continue;
  const hits = floats(of.hits), most = hits[2], [left, right, top, bottom] = [40, 12, 14, 34], width = 760;
  const ends = k => Array.from(hits.filter((_, at) => at % 3 === k)).concat(of.chosen.map(({ place }) => place[k]));
  const along = ends(0), low = Math.min(...along), span = Math.max(Math.max(...along) - low, 1);
  const tall = 1.05 * Math.max(...ends(1), of.height ?? 0, 0.1), height = Math.min(Math.max(width * tall / span, 140), 380) + top + bottom;
  const x = value => (left + (value - low) / span * (width - left - right)).toFixed(1);
  const y = value => (top + (tall - Math.max(value, 0)) / tall * (height - top - bottom)).toFixed(1);
  const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, style: "max-width: 56rem", role: "img", "aria-label": `Crossings of line ${of.line}` });
  for (const value of ticks(0, tall, 5)) svg.append(make("line", { class: "axis", x1: left, x2: width - right, y1: y(value), y2: y(value) }),
    make("text", { x: left - 6, y: Number(y(value)) + 4, "text-anchor": "end" }, shown(value)));
  for (const value of ticks(low, low + span, 8)) svg.append(make("text", { x: x(value), y: height - 18, "text-anchor": "middle" }, shown(value)));
  svg.append(make("text", { x: width / 2, y: height - 3, "text-anchor": "middle" }, "along the line [m]; upwards: height of the centre [m]"));
  const tone = energy => `var(--r${step(32767 * energy / most)})`;
  for (let k = hits.length - 3; k >= 0; k -= 3) svg.append(make("circle", { cx: x(hits[k]), cy: y(hits[k + 1]), r: 3.2, fill: tone(hits[k + 2]) }));
  if (of.height !== null) svg.append(make("path", { d: `M${left} ${y(of.height)}H${width - right}`, stroke: "var(--alarm)", "stroke-dasharray": "6 4", fill: "none" }),
    make("text", { x: width - right, y: y(of.height) - 4, "text-anchor": "end" }, `height of the barrier, ${shown(of.height)} m`));
  for (const { place, member, held } of of.chosen) {
    const [cx, cy] = [x(place[0]), y(place[1])];
    svg.append(held ? make("circle", { class: "place", cx, cy, r: 7 }) : make("path", { class: "place", d: `M${cx - 6} ${cy - 6}l12 12m0 -12l-12 12` }),
      make("text", { x: cx, y: Number(cy) + (cy < 30 ? 20 : -10), "text-anchor": cx > width - 40 ? "end" : "middle" }, member));
  }
  const key = make("div", { class: "legend" }, "Energy, rotation included [kJ]:");
  for (let k = 0; k < 8; k++) key.append(make("span", {}, make("i", { class: "swatch", style: `background:var(--r${k})` }), ` from ${shown(most * (k / 8) ** 2 / 1e3, 2)}`));
  const drawn = hits.length / 3, note = drawn < of.count ? `Drawn: the ${drawn} of most energy of ${of.count}. ` : `First crossings of ${of.count} members. `;
  const marks = of.chosen.length ? "Circle: the barrier held this member; cross: it did not, or its fate is open; the number is the member's." : "";
  home.append(make("figure", { class: "whole" }, make("figcaption", {}, `Where rocks cross line ${of.line}`), svg, key, make("p", { class: "note" }, note + marks)));
}
