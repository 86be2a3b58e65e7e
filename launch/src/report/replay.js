// The replay in space: rock, structure coloured by force, terrain.

const WIDE = 2048;
const LINES = `#version 300 es
uniform mat4 camera; uniform vec2 size; uniform vec3 ramp[9];
uniform highp sampler2D places; uniform highp usampler2D steps;
in vec4 line; in vec2 corner;
out vec3 colour;
ivec2 at(float number) { return ivec2(int(number) % ${WIDE}, int(number) / ${WIDE}); }
void main() {
  vec4 p = camera * vec4(texelFetch(places, at(line.x), 0).xyz, 1.0), q = camera * vec4(texelFetch(places, at(line.y), 0).xyz, 1.0);
  uint of = texelFetch(steps, at(line.z), 0).r;
  vec2 along = q.xy / q.w * size - p.xy / p.w * size;
  along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  vec4 end = corner.x < 0.5 ? p : q;
  end.xy += 0.5 * vec2(-along.y, along.x) * corner.y * line.w / size * end.w;
  end.z -= 2e-4 * end.w;
  gl_Position = of > 8u || p.w < 0.01 || q.w < 0.01 ? vec4(2.0, 2.0, 2.0, 1.0) : end;
  colour = ramp[min(of, 8u)];
}`;
const FLAT = `#version 300 es
precision highp float;
in vec3 colour; out vec4 pixel;
void main() { pixel = vec4(colour, 1.0); }`;
const MESH = `#version 300 es
uniform mat4 camera; uniform mat4 turn;
in vec3 corner;
out vec3 place;
void main() { place = (turn * vec4(corner, 1.0)).xyz; gl_Position = camera * vec4(place, 1.0); }`;
const SHADED = `#version 300 es
precision highp float;
uniform vec3 colour; uniform vec3 up; uniform float contours;
in vec3 place; out vec4 pixel;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.55 + 0.45 * abs(dot(normal, normalize(up + vec3(0.5, 0.3, 0.2))));
  float height = dot(place, up) / max(contours, 1e-6);
  float line = contours > 0.0 && fract(height) < 1.5 * fwidth(height) ? 0.8 : 1.0;
  pixel = vec4(colour * light * line, 1.0);
}`;

const plus = (a, b, factor = 1) => a.map((value, k) => value + factor * b[k]);

/** The matrix that shows what is seen from `eye` towards `target`, of a picture so many times as wide as high. */
function camera(eye, target, up, aspect, reach) {
  const back = unit(plus(eye, target, -1)), right = unit(cross(up, back)), top = cross(back, right);
  const [near, far, f] = [reach / 500, 20 * reach, 2.2];
  const [a, b] = [(far + near) / (near - far), 2 * far * near / (near - far)];
  const [x, y, z] = [right, top, back].map(axis => -inner(axis, eye));
  const column = k => [f / aspect * right[k], f * top[k], a * back[k], -back[k]];
  return new Float32Array([...column(0), ...column(1), ...column(2), f / aspect * x, f * y, a * z + b, -z]);
}
/** The matrix of a rock's place and turn. */
function turned([x, y, z, w, i, j, k]) {
  return new Float32Array([1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w), 0,
    2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w), 0,
    2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j), 0, x, y, z, 1]);
}

/** A replay in `home`; what it answers lets a test ask what it shows. */
function replay(home) {
  const canvas = make("canvas", { tabindex: 0, role: "img", "aria-label": "Replay in space: arrow keys take the moment back and on, with shift they turn the view, + and - come nearer and go away, space plays" });
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) {
    home.append(make("p", { class: "alarm" }, "This browser shows nothing in space (it has no WebGL 2)."));
    return null;
  }
  const build = (vertex, fragment) => {
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const at = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name } = gl.getActiveUniform(program, k);
      at[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  };
  const lines = build(LINES, FLAT), solid = build(MESH, SHADED);
  const filled = (values, buffer = gl.createBuffer()) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    return buffer;
  };
  const attribute = (program, name, count, stride = 0, offset = 0) => {
    const at = gl.getAttribLocation(program.program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, count, gl.FLOAT, false, stride, offset);
  };
  /** Triangles, three corners each. */
  const mesh = corners => {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffer = filled(corners);
    attribute(solid, "corner", 3);
    return { array, buffer, corners };
  };
  /** A texture of numbers on its own unit, one after the other, which a shader reads by their number. `fill` takes over the first `count`. */
  const table = (unit, Kind, parts, count, ...form) => {
    const high = Math.max(Math.ceil(count / WIDE), 1), values = new Kind(parts * WIDE * high);
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, form[0], WIDE, high, 0, ...form.slice(1), null);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    return { values, fill(count) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDE, Math.ceil(count / WIDE), ...form.slice(1), values);
    } };
  };

  // Nodes and lines of the structure, then those of the paths of the rocks. A line is two triangles, of six corners.
  const own = scene.lines ? scene.lines.length / 2 : 0, nodes = scene.nodes ?? 0, width = own && widths();
  const ends = Array.from({ length: own }, (_, k) => [scene.lines[2 * k], scene.lines[2 * k + 1], k, width(scene.parts[k])]), path = [];
  for (const { poses } of scene.rocks) {
    const every = 7 * Math.max(Math.floor(poses.length / 7 / 600), 1);
    for (let k = 0; k < poses.length; k += every) {
      const node = nodes + path.length;
      if (k) ends.push([node - 1, node, ends.length, 1.5]);
      path.push(poses.subarray(k, k + 3));
    }
  }
  const places = table(0, Float32Array, 4, nodes + path.length, gl.RGBA32F, gl.RGBA, gl.FLOAT);
  const steps = table(1, Uint8Array, 1, ends.length, gl.R8UI, gl.RED_INTEGER, gl.UNSIGNED_BYTE);
  path.forEach((place, k) => places.values.set(place, 4 * (nodes + k)));
  steps.values.fill(8, own);
  places.fill(nodes + path.length);
  steps.fill(ends.length);
  const strip = gl.createVertexArray();
  gl.bindVertexArray(strip);
  filled(new Float32Array(ends.flatMap(end => [[0, -1], [0, 1], [1, -1], [0, 1], [1, -1], [1, 1]].flatMap(corner => [...end, ...corner]))));
  attribute(lines, "line", 4, 24);
  attribute(lines, "corner", 2, 24, 16);
  const faces = mesh(new Float32Array(3 * (scene.faces?.length ?? 0)));
  const rocks = scene.rocks.map(rock => mesh(rock.corners));
  const terrain = scene.terrain ? mesh(floats(scene.terrain)) : null;

  // The step of colour of each line in each frame; 255: it is broken.
  const tones = new Uint8Array(own * scene.frames.length);
  for (let k = 0; k < tones.length; k++) tones[k] = scene.forces[k] === BROKEN ? 255 : step(scene.forces[k]);
  // Between two frames nodes go straight; a force is that of the nearer one.
  const shownAt = { before: 0, after: 0, share: 0 };
  function move(time) {
    if (!nodes) return;
    const after = place(scene.frames, time), before = Math.max(after - (scene.frames[after] > time ? 1 : 0), 0);
    const share = after > before ? Math.max((time - scene.frames[before]) / (scene.frames[after] - scene.frames[before]), 0) : 0;
    Object.assign(shownAt, { before, after, share });
    const { scale, faces: corners } = scene, { values } = places, all = scene.places, near = own * (share < 0.5 ? before : after);
    for (let node = 0, at = 0, from = 3 * nodes * before, to = 3 * nodes * after; node < nodes; node++, at++) {
      for (let k = 0; k < 3; k++, at++, from++, to++) values[at] = scale * (all[from] + share * (all[to] - all[from]));
    }
    steps.values.set(tones.subarray(near, near + own));
    places.fill(nodes);
    steps.fill(own);
    if (!corners.length) return;
    for (let k = 0, at = 0; k < corners.length; k++) for (let i = 0; i < 3; i++, at++) faces.corners[at] = values[4 * corners[k] + i];
    gl.bindBuffer(gl.ARRAY_BUFFER, faces.buffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, faces.corners);
  }

  // The eye turns about a target; it looks towards where the rock comes from.
  const up = unit(scene.up);
  const spread = nodes ? Array.from({ length: nodes }, (_, k) => [0, 1, 2].map(i => scene.scale * scene.places[3 * k + i]))
    : scene.rocks.flatMap(({ poses }) => Array.from({ length: poses.length / 7 }, (_, k) => [...poses.subarray(7 * k, 7 * k + 3)]));
  const box = [0, 1, 2].map(k => spread.reduce(([low, high], at) => [Math.min(low, at[k]), Math.max(high, at[k])], [Infinity, -Infinity]));
  const middle = box.map(([low, high]) => (low + high) / 2), reach = Math.max(...box.map(([low, high]) => high - low), 1);
  let front = scene.axes ? scene.axes[2] : [0.3, -1, 0];
  if (Math.abs(inner(front, up)) > 0.7) front = scene.axes[1];
  const [rock] = scene.rocks;
  if (rock && inner(plus(pose(rock, scene.peak?.time ?? scene.to), pose(rock, scene.from), -1), front) < 0) front = front.map(value => -value);
  const level = unit(plus(front, up, -inner(front, up))), side = cross(up, level);
  const eye = {};
  const home_view = () => {
    const away = 0.76 * Math.hypot(...box.map(([low, high]) => high - low)) * Math.max(1, 1.75 * canvas.clientHeight / canvas.clientWidth);
    Object.assign(eye, { turn: 0.45, rise: 0.3, away: nodes ? away : Math.min(reach, 40 * rock.radius), shift: [0, 0, 0] });
  };

  const still = turned([0, 0, 0, 1, 0, 0, 0]), contours = ticks(0, reach, 12)[1];
  let ramp, ground, stone, sheet;
  function paint() {
    const style = getComputedStyle(document.documentElement);
    const colour = name => [1, 3, 5].map(k => parseInt(style.getPropertyValue(name).trim().slice(k, k + 2), 16) / 255);
    ramp = new Float32Array([0, 1, 2, 3, 4, 5, 6, 7].flatMap(k => colour(`--r${k}`)).concat(colour("--alarm")));
    [ground, stone, sheet] = [colour("--ground"), colour("--rock"), ramp.slice(6, 9)];
  }
  function draw() {
    const { width: wide, height: high } = canvas;
    gl.viewport(0, 0, wide, high);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const poses = scene.rocks.map(rock => pose(rock, view.time));
    const target = plus(follow.checked && poses[0] ? poses[0].slice(0, 3) : middle, eye.shift);
    const flat = plus(level.map(value => value * Math.cos(eye.turn)), side, Math.sin(eye.turn));
    const from = plus(plus(target, flat, eye.away * Math.cos(eye.rise)), up, eye.away * Math.sin(eye.rise));
    const matrix = camera(from, target, up, wide / high, eye.away);
    gl.useProgram(solid.program);
    gl.uniformMatrix4fv(solid.at.camera, false, matrix);
    gl.uniform3fv(solid.at.up, up);
    const fill = (of, colour, turn, contours) => {
      gl.uniformMatrix4fv(solid.at.turn, false, turn);
      gl.uniform3fv(solid.at.colour, colour);
      gl.uniform1f(solid.at.contours, contours);
      gl.bindVertexArray(of.array);
      gl.drawArrays(gl.TRIANGLES, 0, of.corners.length / 3);
    };
    if (terrain) fill(terrain, ground, still, contours);
    if (faces.corners.length) fill(faces, sheet, still, 0);
    rocks.forEach((rock, k) => fill(rock, stone, turned(poses[k]), 0));
    gl.useProgram(lines.program);
    gl.uniformMatrix4fv(lines.at.camera, false, matrix);
    gl.uniform2f(lines.at.size, wide / density / 2, high / density / 2);
    gl.uniform3fv(lines.at.ramp, ramp);
    gl.uniform1i(lines.at.places, 0);
    gl.uniform1i(lines.at.steps, 1);
    gl.bindVertexArray(strip);
    gl.drawArrays(gl.TRIANGLES, 0, 6 * ends.length);
  }
  let asked = false;
  // Asked for here alone: the page would be laid out anew in each frame.
  let density;
  function measure() {
    density = window.devicePixelRatio || 1;
    [canvas.width, canvas.height] = [canvas.clientWidth, canvas.clientHeight].map(of => Math.max(Math.round(of * density), 2));
    draw();
  }
  const ask = () => { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; draw(); }); } };

  // What one works it with.
  const span = scene.to - scene.from;
  const slider = make("input", { type: "range", min: scene.from, max: scene.to, step: span / 2000, "aria-label": "Moment [s]" });
  const play = make("button", { type: "button" }, "Play"), said = make("output");
  const speeds = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
  const speed = make("select", { "aria-label": "Speed" }, ...speeds.map(of => make("option", { value: of }, `${of} × real time`)));
  speed.value = speeds.find(of => of * 10 >= span) ?? 10;
  const follow = make("input", { type: "checkbox" });
  follow.checked = !nodes;
  const bar = make("div", { class: "bars" }, play, slider, said, speed);
  if (scene.peak && nodes) {
    const time = scene.frames[frame(scene.peak.time)];
    bar.append(make("button", { type: "button", "data-time": time, title: `${scene.peak.name} at ${shown(scene.peak.time)} s` }, "Frame of the largest force"));
  }
  const again = make("button", { type: "button" }, "View as at first");
  bar.append(make("label", {}, follow, " follow the rock"), again);
  const rest = nodes ? `${scene.frames.length} of ${scene.written} frames of the structure; between two of them nodes go straight, and a force is that of the nearer one. What is broken is left out.` : "";
  home.append(canvas, bar, ...own ? [colours()] : [],
    make("p", { class: "note" }, make("span", { class: "screen" }, "Drag to turn, with shift to move, wheel or + and - for the distance; arrow keys for the moment, with shift to turn; space plays. "), rest));
  let last = null;
  function run(now) {
    if (last === null) return;
    const time = view.time + Math.min(now - last, 100) / 1e3 * Number(speed.value);
    last = now;
    show({ time: time >= scene.to ? scene.from : time });
    requestAnimationFrame(run);
  }
  play.addEventListener("click", () => {
    last = last === null ? performance.now() : null;
    play.textContent = last === null ? "Play" : "Pause";
    if (last !== null) requestAnimationFrame(run);
  });
  slider.addEventListener("input", () => show({ time: Number(slider.value) }));
  follow.addEventListener("change", () => { home_view(); ask(); });
  again.addEventListener("click", () => { home_view(); ask(); });
  const away = factor => { eye.away = Math.min(Math.max(eye.away * factor, reach / 300), 6 * reach); ask(); };
  const turn = (x, y) => { eye.turn -= x; eye.rise = Math.min(Math.max(eye.rise + y, -1.5), 1.5); ask(); };
  canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", event => {
    if (!event.buttons) return;
    if (!event.shiftKey && event.buttons === 1) { turn(event.movementX / 150, event.movementY / 150); return; }
    const size = eye.away / canvas.clientHeight;
    const right = plus(side.map(value => value * Math.cos(eye.turn)), level, -Math.sin(eye.turn));
    eye.shift = plus(plus(eye.shift, right, -event.movementX * size), up, event.movementY * size);
    ask();
  });
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("wheel", event => { event.preventDefault(); away(Math.exp(event.deltaY / 800)); }, { passive: false });
  canvas.addEventListener("keydown", event => {
    const turns = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    if (event.shiftKey && turns[event.key]) turn(...turns[event.key]);
    else if (event.key === " ") play.click();
    else if (event.key === "+" || event.key === "-") away(event.key === "+" ? 0.8 : 1.25);
    else { pressed(event, span / 200); return; }
    event.preventDefault();
  });
  const update = () => {
    move(view.time);
    slider.value = view.time;
    said.textContent = `t = ${view.time.toFixed(4)} s`;
    ask();
  };
  for (const query of ["print", "(prefers-color-scheme: dark)"]) matchMedia(query).addEventListener("change", () => { paint(); draw(); });
  new ResizeObserver(measure).observe(canvas);
  view.watchers.push(update);
  home_view();
  paint();
  update();
  measure();
  return { draw, gl, shownAt, places: places.values, nodes };
}

const stage = document.getElementById("replay");
if (scene && !data.charts) show({ time: scene.peak?.time ?? scene.from, whole: [scene.from, scene.to], from: scene.from, to: scene.to });
const played = stage && replay(stage);

// `#test=TIME` leaves in the page what it shows at this moment, for a test.
if (location.hash.startsWith("#test=")) {
  const time = Number(location.hash.slice(6)), pixel = new Uint8Array(4);
  /** Milliseconds of a frame, the median of so many over the whole replay: of its script, with the layout of the page, or until its picture is there. */
  const cost = (count, after) => {
    const spent = Array.from({ length: count }, (_, k) => {
      const begin = performance.now();
      show({ time: scene.from + (k + 0.5) / count * (scene.to - scene.from) });
      played.draw();
      after();
      return performance.now() - begin;
    });
    return spent.sort((a, b) => a - b)[count >> 1];
  };
  const read = () => played.gl.readPixels(0, 0, 1, 1, played.gl.RGBA, played.gl.UNSIGNED_BYTE, pixel);
  const pixels = all => { if (all) played.gl.disable(played.gl.SCISSOR_TEST); else { played.gl.enable(played.gl.SCISSOR_TEST); played.gl.scissor(0, 0, 1, 1); } };
  // Where the picture is drawn in software, the first two would wait for it.
  if (played) pixels(false);
  const milliseconds = played && [cost(100, () => {}), cost(100, () => document.body.offsetHeight), (pixels(true), cost(1, read))];
  show({ time });
  tell(true);
  const known = {
    time: view.time, milliseconds, requests: performance.getEntriesByType("resource").length, curves: document.querySelectorAll("#curves figure").length,
    values: [...document.querySelectorAll("#curves .legend button")].map(of => [of.textContent, of.lastChild.textContent]),
    ...played?.shownAt, points: played && Array.from({ length: 3 * played.nodes }, (_, k) => played.places[4 * Math.floor(k / 3) + k % 3]),
    rocks: scene && scene.rocks.map(rock => pose(rock, view.time)), error: played?.gl.getError(),
  };
  document.body.append(make("pre", { id: "test", hidden: "" }, JSON.stringify(known)));
}
