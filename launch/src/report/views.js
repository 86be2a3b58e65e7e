// The structure from the front and from its side, as pictures.

/** The replay's data as arrays: places of nodes [m], forces of lines [N], poses of rocks. */
function unpack(of) {
  const rocks = of.rocks.map(rock => ({ ...rock, corners: floats(rock.corners), times: floats(rock.times), poses: floats(rock.poses) }));
  if (!of.lines) return { ...of, rocks, frames: [of.from] };
  return { ...of, rocks, lines: new Uint32Array(bytes(of.lines)), faces: new Uint32Array(bytes(of.faces)),
    parts: new Uint8Array(bytes(of.parts)), places: new Int16Array(bytes(of.places)), forces: new Int16Array(bytes(of.forces)) };
}
const scene = data.replay && unpack(data.replay);
const BROKEN = -32768;

/** The frame nearest to `time` [s]. */
function frame(time) {
  const at = place(scene.frames, time);
  return at > 0 && time - scene.frames[at - 1] < scene.frames[at] - time ? at - 1 : at;
}
/** Place and turn of a rock at `time` [s]: x, y, z and a unit quaternion w, x, y, z. */
function pose({ times, poses }, time) {
  const after = place(times, time), before = Math.max(after - 1, 0);
  const share = after > before ? Math.min(Math.max((time - times[before]) / (times[after] - times[before]), 0), 1) : 0;
  const [a, b] = [poses.subarray(7 * before, 7 * before + 7), poses.subarray(7 * after, 7 * after + 7)];
  const same = a[3] * b[3] + a[4] * b[4] + a[5] * b[5] + a[6] * b[6] < 0 ? -1 : 1;
  const mixed = Array.from(a, (value, k) => value + share * ((k < 3 ? 1 : same) * b[k] - value));
  const norm = Math.hypot(...mixed.slice(3));
  return mixed.map((value, k) => k < 3 ? value : value / norm);
}
/** Which of eight steps of colour a force has: they are those of its square root, as one rope bears far more than a net. */
const step = force => Math.min(Math.floor(8 * Math.sqrt(Math.abs(force) / 32767)), 7);
const inner = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => { const norm = Math.hypot(...a) || 1; return a.map(value => value / norm); };
/** Ends of the steps [N]. */
const limits = () => Array.from({ length: 9 }, (_, k) => 32767 * scene.newton * (k / 8) ** 2);
/** Width of the lines of a part: a net has many, a rope some, a post few. */
const widths = () => {
  const count = new Map();
  for (const part of scene.parts) count.set(part, (count.get(part) ?? 0) + 1);
  return part => count.get(part) > 250 ? 1.1 : count.get(part) > 40 ? 2 : 3.4;
};

/** A view with `right` to the right and `up` up; with `along` (0: to the right, 1: up) the envelope of all frames across it. */
function picture(title, right, up, at, along) {
  const dot = (axis, k, places = scene.places, scale = scene.scale) => scale * (axis[0] * places[k] + axis[1] * places[k + 1] + axis[2] * places[k + 2]);
  const spot = (of, node) => { const k = 3 * (of * scene.nodes + node); return [dot(right, k), dot(up, k)]; };
  const centre = (rock, time) => { const at = pose(rock, time); return [dot(right, 0, at, 1), dot(up, 0, at, 1)]; };
  // All triangles turned alike, so that none is a hole in another.
  const outline = (rock, time) => {
    const turn = turned(pose(rock, time)), { corners } = rock;
    const seen = k => { const at = [0, 1, 2].map(i => turn[12 + i] + turn[i] * corners[k] + turn[4 + i] * corners[k + 1] + turn[8 + i] * corners[k + 2]); return [dot(right, 0, at, 1), dot(up, 0, at, 1)]; };
    let d = "";
    for (let k = 0; k < corners.length; k += 9) {
      const [a, b, c] = [seen(k), seen(k + 3), seen(k + 6)], left = (b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0]);
      d += `M${(left ? [a, b, c] : [c, b, a]).map(to).join("L")}Z`;
    }
    return d;
  };
  const touches = scene.impacts.flatMap(({ rock, time }) => scene.rocks.filter(of => of.name === rock).map(of => ({ of, time, place: centre(of, time) })));
  const ends = [[Infinity, -Infinity], [Infinity, -Infinity]];
  const grow = (place, room) => ends.forEach((end, k) => { end[0] = Math.min(end[0], place[k] - room); end[1] = Math.max(end[1], place[k] + room); });
  // What was torn off and flies is no part of the picture: of other frames the outermost nodes do not count.
  for (let of = 0; of < scene.frames.length; of++) {
    const spots = Array.from({ length: scene.nodes }, (_, node) => spot(of, node)), out = of && of !== at ? Math.floor(scene.nodes / 50) : 0;
    const sorted = [0, 1].map(k => Float64Array.from(spots, place => place[k]).sort());
    for (const end of [out, scene.nodes - 1 - out]) grow(sorted.map(values => values[end]), 0.1);
  }
  for (const { of, place } of touches) grow(place, of.radius);
  const [xs, ys] = ends, spans = ends.map(([low, high]) => high - low), broad = spans[0] > 2.5 * spans[1];
  const scale = Math.min((broad ? 1180 : 580) / spans[0], 400 / spans[1]), size = [Math.max(scale * spans[0], 220), scale * spans[1] + 26];
  const to = ([x, y]) => `${(scale * (x - xs[0])).toFixed(1)} ${(scale * (ys[1] - y)).toFixed(1)}`;
  const line = (of, k) => `M${to(spot(of, scene.lines[2 * k]))}L${to(spot(of, scene.lines[2 * k + 1]))}`;
  const svg = make("svg", { viewBox: `0 0 ${size[0]} ${size[1]}`, style: `max-width:${size[0]}px`, role: "img", "aria-label": title });
  const all = scene.lines.length / 2, width = widths();
  if (along !== undefined) {
    const steps = 60, [low, span] = [ends[along][0], spans[along]], reach = Array.from({ length: steps + 1 }, () => [Infinity, -Infinity]);
    const reached = (step, value) => { reach[step] = [Math.min(reach[step][0], value), Math.max(reach[step][1], value)]; };
    for (let of = 0; of < scene.frames.length; of++) for (let k = 0; k < all; k++) {
      if (scene.forces[of * all + k] === BROKEN) continue;
      // A line counts where it crosses a step, and at its ends.
      const [a, b] = [0, 1].map(end => spot(of, scene.lines[2 * k + end])).map(at => [steps * (at[along] - low) / span, at[1 - along]]);
      for (const [at, value] of [a, b]) reached(Math.round(at), value);
      for (let at = Math.ceil(Math.min(a[0], b[0])); at < Math.max(a[0], b[0]); at++) reached(at, a[1] + (at - a[0]) / (b[0] - a[0]) * (b[1] - a[1]));
    }
    const there = reach.map((end, k) => [end, low + k / steps * span]).filter(([end]) => end[0] <= end[1]);
    const side = k => there.map(([end, at]) => along ? [end[k], at] : [at, end[k]]);
    svg.append(make("path", { class: "reach", d: `M${[...side(0), ...side(1).reverse()].map(to).join("L")}Z` }));
  }
  let rest = "";
  const paths = new Map();
  for (let k = 0; k < all; k++) {
    rest += line(0, k);
    const force = scene.forces[at * all + k];
    if (force === BROKEN) continue;
    const key = `${step(force)} ${width(scene.parts[k])}`;
    paths.set(key, (paths.get(key) ?? "") + line(at, k));
  }
  svg.append(make("path", { class: "rest", d: rest }));
  for (const [key, d] of [...paths].sort()) {
    const [colour, wide] = key.split(" ");
    svg.append(make("path", { d, fill: "none", stroke: `var(--r${colour})`, "stroke-width": wide, "stroke-linecap": "round" }));
  }
  for (const { of, time, place } of touches) {
    const path = Array.from({ length: 200 }, (_, k) => centre(of, scene.from + k / 199 * (scene.to - scene.from)));
    const inside = path.filter(at => at.every((value, k) => value >= ends[k][0] && value <= ends[k][1]));
    const [x, y] = to(place).split(" ");
    svg.append(make("path", { class: "place", "stroke-dasharray": "3 3", d: `M${inside.map(to).join("L")}` }),
      make("path", { class: "rock", d: outline(of, time) }), make("path", { class: "place", d: `M${x - 6} ${y}h12M${x} ${y - 6}v12` }));
  }
  const power = 10 ** Math.floor(Math.log10(0.3 * spans[0])), metres = shown(power * [5, 2, 1].find(of => of * power <= 0.3 * spans[0]));
  svg.append(make("path", { d: `M1 ${size[1] - 6}v-5v5H${1 + scale * metres}v-5`, fill: "none", stroke: "var(--ink)" }),
    make("text", { x: 8 + scale * metres, y: size[1] - 4 }, `${metres} m, 1:1`));
  return make("figure", broad ? { class: "whole" } : {}, make("figcaption", {}, title), svg);
}

/** The scale of colours, with its forces [kN]. */
function colours() {
  const ends = limits(), key = make("div", { class: "legend", role: "group", "aria-label": "Axial force" }, "Axial force, magnitude [kN]:");
  for (let k = 0; k < 8; k++) key.append(make("span", {}, make("i", { class: "swatch", style: `background:var(--r${k})` }),
    ` ${shown(ends[k] / 1e3, 2)}${k < 7 ? "" : ` to ${shown(ends[8] / 1e3, 3)}`}`));
  return key;
}

const views = document.getElementById("views");
if (views) {
  const [along, up, across] = scene.axes, at = scene.peak ? frame(scene.peak.time) : scene.frames.length - 1;
  // What lies, as in a drop test, is seen along gravity, and from its side with gravity downwards.
  const lift = inner(scene.up, across), lies = Math.abs(lift) > 0.87 * Math.hypot(...scene.up);
  const side = "From the side, with the envelope of all frames";
  views.prepend(make("div", { class: "grid" }, picture(lies ? "Along gravity" : "From the front", along, up, at),
    lies ? picture(side, along, across.map(of => Math.sign(lift) * of), at, 0) : picture(side, unit(cross(along, scene.up)), unit(scene.up), at, 1)), colours());
  const moment = scene.peak ? `the frame nearest to ${scene.peak.name} at ${shown(scene.peak.time)} s` : "the last frame";
  views.append(make("p", { class: "note" }, `At ${shown(scene.frames[at])} s, ${moment}; grey: as it stood at the start; brown: the rock at its first touch; dashed: the path of its centre.`));
}
