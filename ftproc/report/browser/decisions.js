// The engineer's decisions: lines of a CSV that clicks write, to be kept as a file.
(function () {
  const text = document.getElementById("decisions");
  if (!text) return;
  const header = text.value.split("\n")[0];
  const rows = header.includes("from_row") ? ",," : ""; // such lines name rows in these columns

  // A line is added; the same line again is taken back, and so is one of another use on the same stretch.
  function decide(component, from, to, use) {
    const stretch = [component, from, to].join(",") + rows + ",";
    const lines = text.value.split("\n").filter(function (line) { return line.trim() !== ""; });
    if (!lines.length) lines.push(header);
    const line = stretch + use + ",";
    const others = lines.filter(function (each) { return !each.startsWith(stretch); });
    if (!lines.some(function (each) { return each.startsWith(line); })) others.push(line);
    text.value = others.join("\n") + "\n";
    text.scrollTop = text.scrollHeight;
    shown();
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
        if (meta && meta.component) decide(meta.component, String(point.x), String(point.x), meta.use);
      });
    });
  }

  document.getElementById("stretch").addEventListener("click", function () {
    const readings = document.getElementById("readings");
    if (!readings || !readings.layout) return;
    const range = readings.layout.xaxis.range.map(function (time) { return String(Number(Number(time).toFixed(6))); });
    decide(document.getElementById("component").value, range[0], range[1], document.getElementById("use").value);
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
