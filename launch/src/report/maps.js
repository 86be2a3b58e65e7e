// Maps of a study: one layer at a time, all as large and at the same place.

const maps = document.getElementById("maps");
if (maps) {
  const layers = [...maps.querySelectorAll("figure")];
  const choice = (label, pairs) => make("select", { "aria-label": label }, ...pairs.map(([value, text]) => make("option", { value }, text)));
  const layer = choice("Layer of the map", layers.map((of, k) => [k, of.firstChild.textContent]));
  const size = choice("Size of the map", [1, 2, 4, 8].map(of => [of, `${of} times as large`]));
  let seen = layers[0];
  const update = () => {
    const [left, top] = [seen.scrollLeft / seen.scrollWidth, seen.scrollTop / seen.scrollHeight];
    seen = layers[layer.value];
    for (const of of layers) of.hidden = of !== seen;
    seen.lastChild.style.width = `max(${100 * size.value}%, ${44 * size.value}rem)`;
    seen.scrollTo(left * seen.scrollWidth, top * seen.scrollHeight);
  };
  for (const of of layers) of.tabIndex = 0;
  for (const of of [layer, size]) of.addEventListener("change", update);
  maps.prepend(make("div", { class: "bars" }, layer, size));
  update();
}
