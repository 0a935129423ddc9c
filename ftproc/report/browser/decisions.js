// The engineer's decisions: lines of a CSV that clicks write, to be kept as a file.
(function () {
  const NEAR = 2e-6; // s: offsets of clocks are not exact
  const text = document.getElementById("decisions");
  if (!text) return;
  const header = text.value.split("\n")[0];
  const rows = header.includes("from_row") ? ",," : ""; // such lines name rows in these columns
  const station = document.getElementById("station"); // of several

  // A line is added; the same line again is taken back, and so is one of another use on the same stretch.
  function decide(component, from, to, use, name) {
    const stretch = [component, from, to].join(",") + rows + ",";
    const lines = text.value.split("\n").filter(function (line) { return line.trim() !== ""; });
    if (!lines.length) lines.push(header);
    const whose = station ? (/[",]/.test(name) ? '"' + name.replaceAll('"', '""') + '"' : name) + "," : "";
    const line = stretch + use + "," + whose;
    const others = lines.filter(function (each) {
      return !each.startsWith(stretch) || !each.slice(stretch.length).replace(/^\w*,/, "").startsWith(whose);
    });
    if (!lines.some(function (each) { return each.startsWith(line); })) others.push(line);
    text.value = others.join("\n") + "\n";
    text.scrollTop = text.scrollHeight;
    shown();
  }

  // Times of the page in those of a station's log, a little wider than both.
  function ends(from, to, clock) {
    return [Number(from) + Number(clock) - NEAR, Number(to) + Number(clock) + NEAR].map(function (time) {
      return String(Number(time.toFixed(6)));
    });
  }

  function shown() {
    for (const button of document.querySelectorAll("button.decide")) {
      const data = button.dataset;
      const line = [data.component, data.start, data.end + rows, data.use].join(",") + ",";
      button.setAttribute("aria-pressed", text.value.includes("\n" + line));
    }
  }

  for (const button of document.querySelectorAll("button.decide")) {
    button.addEventListener("click", function () {
      decide(button.dataset.component, button.dataset.start, button.dataset.end, button.dataset.use);
    });
  }

  for (const place of document.querySelectorAll("figure")) {
    place.addEventListener("drawn", function () {
      place.on("plotly_click", function (event) {
        const point = event.points[0], meta = point.data.meta;
        if (!meta || !meta.component) return;
        if (!meta.station) decide(meta.component, String(point.x), String(point.x), meta.use);
        else decide(meta.component, ...ends(point.x, point.x, meta.clock), meta.use, meta.station);
      });
    });
  }

  document.getElementById("stretch").addEventListener("click", function () {
    const shows = document.getElementById(station ? "residuals" : "readings");
    if (!shows || !shows.layout) return;
    const range = shows.layout.xaxis.range.map(function (time) { return String(Number(Number(time).toFixed(6))); });
    const stretch = station ? ends(range[0], range[1], station.selectedOptions[0].dataset.clock) : range;
    decide(document.getElementById("component").value, ...stretch, document.getElementById("use").value,
      station && station.value);
  });

  text.addEventListener("input", shown);
  document.getElementById("keep").addEventListener("click", function (event) {
    const link = document.createElement("a");
    link.download = event.target.dataset.file;
    link.href = URL.createObjectURL(new Blob([text.value.replace(/\n*$/, "\n")], { type: "text/csv" }));
    link.click();
    setTimeout(function () { URL.revokeObjectURL(link.href); }, 1000);
  });
})();
