// Unpacks the library, draws the figures one after the other, thins crowded marks to the extremes of each column (all of
// them appear on zooming in), and redraws in the width of the paper for printing.
(function () {
  const PAPER = 680; // CSS pixels between the margins of an A4 or Letter page
  const LOWER = 0.7; // share of the height, so that two figures fit a page
  const HALF = 470, TALLEST = 900; // CSS pixels of half a page, and of a page, under the title of a section
  const SHARP = 3; // pixels of a picture on paper, per CSS pixel
  const paper = "paper" in document.documentElement.dataset; // drawn to be printed, and for nothing else
  const BROAD = 1.6; // width over height from which the whole space is visible with its labels
  const COLUMNS = 400; // of a figure; in each the lowest and the highest mark of a kind are drawn
  const config = { displaylogo: false, responsive: !paper, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
  const places = Array.from(document.querySelectorAll("figure"));

  function bytes(base64) {
    const text = atob(base64);
    const found = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) found[i] = text.charCodeAt(i);
    return found;
  }

  async function unpack() {
    const packed = new Blob([bytes(document.getElementById("library").textContent)]);
    const script = document.createElement("script");
    script.textContent = await new Response(packed.stream().pipeThrough(new DecompressionStream("gzip"))).text();
    document.body.append(script);
  }

  function nextFrame() {
    return new Promise(function (done) { requestAnimationFrame(function () { setTimeout(done); }); });
  }

  function array(packed) {
    const kind = { f4: Float32Array, f8: Float64Array }[packed && packed.dtype];
    return kind ? new kind(bytes(packed.bdata).buffer) : packed;
  }

  // Indices, in order, of the lowest and the highest mark of each column between two times; of few marks all.
  function extremes(x, y, from, to) {
    const inside = [];
    for (let i = 0; i < x.length; i++) if (x[i] >= from && x[i] <= to) inside.push(i);
    if (inside.length <= 2 * COLUMNS) return inside;
    const found = new Set();
    let column = -1, low, high;
    for (const i of [...inside, null]) {
      const its = i === null ? COLUMNS : Math.floor((COLUMNS * (x[i] - from)) / (to - from));
      if (its !== column) {
        if (column >= 0) found.add(Math.min(low, high)).add(Math.max(low, high));
        column = its;
        low = high = i;
      } else if (i !== null) {
        if (y[i] < y[low]) low = i;
        if (y[i] > y[high]) high = i;
      }
    }
    return Array.from(found);
  }

  function shown(all, range) {
    const chosen = extremes(all.x, all.y, Number(range[0]), Number(range[1]));
    const part = {};
    for (const name in all) part[name] = chosen.map(function (i) { return all[name][i]; });
    return part;
  }

  // Crowded marks, by the index of their trace; the trace keeps those drawn at first.
  function thin(figure) {
    const crowded = new Map();
    figure.data.forEach(function (trace, index) {
      if (trace.mode !== "markers" || !figure.layout.xaxis || !figure.layout.xaxis.range) return;
      if (trace.type === "scattergl") trace.type = "scatter"; // faster than WebGL for so few marks
      const all = { x: array(trace.x), y: array(trace.y) };
      if (all.x.length <= 2 * COLUMNS) return;
      if (trace.customdata) all.customdata = array(trace.customdata);
      crowded.set(index, all);
      Object.assign(trace, shown(all, figure.layout.xaxis.range));
    });
    return crowded;
  }

  // Factor on the distance of the eye for an element of this size.
  function distance(width, height) { return Math.max(1, (BROAD * height) / width); }

  // The size of a figure between the margins of a page.
  function printed(place) {
    const width = PAPER / place.parentNode.querySelectorAll("figure").length;
    const whole = parseInt(place.dataset.height, 10);
    const height = LOWER * whole <= HALF ? LOWER * whole : Math.min(whole, TALLEST);
    return { width: width, height: height, autosize: false };
  }

  function moved(eye, factor) { return { x: factor * eye.x, y: factor * eye.y, z: factor * eye.z }; }

  async function draw(place) {
    const data = document.querySelector('script[data-figure="' + place.id + '"]');
    const figure = JSON.parse(data.textContent);
    const crowded = thin(figure);
    const camera = figure.layout.scene && figure.layout.scene.camera;
    if (paper) {
      Object.assign(figure.layout, printed(place));
      place.style.height = figure.layout.height + "px";
    }
    timeTicks.prepare(figure.layout, figure.layout.width || place.clientWidth);
    if (camera) {
      place.away = distance(figure.layout.width || place.clientWidth, place.clientHeight);
      camera.eye = moved(camera.eye, place.away);
    }
    if (paper && camera) { // a picture: what WebGL draws may not be on its canvas when the page is printed
      const picture = new Image(figure.layout.width, figure.layout.height);
      picture.src = await Plotly.toImage(figure, { format: "png", width: picture.width, height: picture.height, scale: SHARP });
      await picture.decode();
      place.replaceChildren(picture);
      return;
    }
    await Plotly.newPlot(place, figure.data, figure.layout, config);
    place.dispatchEvent(new Event("drawn"));
    place.on("plotly_relayout", function (changed) {
      if (!Object.keys(changed).some(function (name) { return /^(xaxis\d*\.(range|autorange)|width|autosize)/.test(name); })) return;
      const ticks = timeTicks.update(place._fullLayout, place.clientWidth);
      if (Object.keys(ticks).length) Plotly.relayout(place, ticks);
      if (!crowded.size) return;
      const parts = Array.from(crowded.values(), function (all) { return shown(all, place._fullLayout.xaxis.range); });
      const update = {};
      for (const name of ["x", "y", "customdata"]) update[name] = parts.map(function (part) { return part[name]; });
      Plotly.restyle(place, update, Array.from(crowded.keys()));
    });
  }

  async function drawAll() {
    if (!window.DecompressionStream) {
      places.forEach(function (place) { place.textContent = "This browser is too old for the figures: use one of 2023 or later."; });
    } else {
      await unpack();
      const inSpace = function (place) { return place.id === "track"; }; // the slowest, therefore last
      for (const place of [...places.filter(function (place) { return !inSpace(place); }), ...places.filter(inSpace)]) {
        await draw(place);
        await nextFrame();
      }
    }
    document.body.dataset.drawn = "yes";
  }

  function resize(place, size) {
    place.style.height = size.height + "px";
    if (!place.data) return;
    const scene = place.layout.scene;
    if (scene) {
      const before = place.away;
      place.away = distance(size.width || place.clientWidth, size.height);
      size = { ...size, "scene.camera.eye": moved(scene.camera.eye, place.away / before) };
    }
    Plotly.relayout(place, size);
  }

  // Shows these seconds, and as much around them, in all figures over the whole time; without them the whole log.
  function zoom(from, to) {
    const room = Math.max(to - from, 1);
    for (const place of places) {
      if (!place.data || place.id === "worst" || place.id === "ground" || place.layout.scene) continue;
      place.whole = place.whole || place.layout.xaxis.range.slice();
      const range = from === "" ? place.whole : [Number(from) - room, Number(to) + room];
      const update = {};
      for (const name in place.layout) if (/^xaxis\d*$/.test(name)) update[name + ".range"] = range.slice();
      Plotly.relayout(place, update);
    }
  }

  // What is folded is printed too.
  function unfold() { for (const each of document.querySelectorAll("details")) each.open = true; }
  if (paper) unfold();

  for (const button of document.querySelectorAll("button[data-from]")) {
    button.addEventListener("click", function () {
      zoom(button.dataset.from, button.dataset.to);
      document.getElementById("readings").scrollIntoView();
    });
  }

  if (!paper) {
    addEventListener("beforeprint", function () {
      unfold();
      places.forEach(function (place) { resize(place, printed(place)); });
    });
    addEventListener("afterprint", function () {
      places.forEach(function (place) {
        resize(place, { width: null, height: parseInt(place.dataset.height, 10), autosize: true });
      });
    });
  }
  // An open document inside the page delays the load event until all is drawn, so that printing at load has all figures.
  const hold = document.body.appendChild(document.createElement("iframe"));
  hold.hidden = true;
  hold.contentDocument.open();
  drawAll().finally(function () {
    hold.contentDocument.close();
    hold.remove();
  });
})();
