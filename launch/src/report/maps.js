// Maps of a study: one layer at a time, all with the same zoom.

const maps = document.getElementById("maps");
if (maps) {
  const layers = [...maps.querySelectorAll("figure")], at = { x: 0, y: 0, zoom: 1 };
  const choose = make("select", { "aria-label": "Layer of the map" }, ...layers.map((layer, k) => make("option", { value: k }, layer.firstChild.textContent)));
  const update = () => layers.forEach((layer, k) => {
    layer.hidden = k !== Number(choose.value);
    layer.lastChild.style.transform = `translate(${at.x}px, ${at.y}px) scale(${at.zoom})`;
  });
  /** Zoom about a point of the picture [px]. */
  const zoomed = (factor, x, y) => {
    const zoom = Math.min(Math.max(at.zoom * factor, 1), 20), share = zoom / at.zoom;
    Object.assign(at, zoom === 1 ? { x: 0, y: 0, zoom } : { x: x - share * (x - at.x), y: y - share * (y - at.y), zoom });
    update();
  };
  const moved = (x, y) => { if (at.zoom > 1) { at.x += x; at.y += y; update(); } };
  maps.prepend(make("div", { class: "bars" }, make("label", {}, "Layer ", choose), make("span", { class: "note" }, "wheel or + and - to zoom, drag or arrow keys to move, 0 for all")));
  choose.addEventListener("change", update);
  maps.addEventListener("wheel", event => {
    if (event.target.tagName !== "IMG") return;
    event.preventDefault();
    const box = event.target.parentElement.getBoundingClientRect();
    zoomed(Math.exp(-event.deltaY / 500), event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
  maps.addEventListener("pointermove", event => event.buttons && event.target.tagName === "IMG" && moved(event.movementX, event.movementY));
  maps.addEventListener("dragstart", event => event.preventDefault());
  for (const layer of layers) {
    layer.tabIndex = 0;
    layer.addEventListener("keydown", event => {
      const [x, y] = [layer.clientWidth / 2, layer.clientHeight / 2];
      const keys = { "+": () => zoomed(1.5, x, y), "-": () => zoomed(1 / 1.5, x, y), 0: () => zoomed(0, x, y),
        ArrowLeft: () => moved(60, 0), ArrowRight: () => moved(-60, 0), ArrowUp: () => moved(0, 60), ArrowDown: () => moved(0, -60) };
      if (keys[event.key]) { keys[event.key](); event.preventDefault(); }
    });
  }
  update();
}
