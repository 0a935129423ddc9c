"use strict";
// Ticks of the axes of time: clock time in UTC where the log's clock is known, and seconds since its first row (T+).
const timeTicks = (function () {
  const STEPS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 20, 30, 60, 120, 300, 600, 900,
    1800, 3600, 7200, 10800, 21600, 43200, 86400]; // s
  const WIDTH = 105; // CSS pixels of a label with the room around it
  const log = document.getElementById("log"); // of the page of a trajectory
  const zero = log && log.dataset.zero !== "" ? Number(log.dataset.zero) / 1000 : null; // s since 1970 at time zero
  const start = log ? Number(log.dataset.start) : 0;
  const used = zero !== null || Math.abs(start) >= 1; // as in files/moments.py

  function clock(time, decimals) { return new Date(Math.round((zero + time) * 1e6) / 1e3).toISOString().slice(11, 20 + (decimals ? decimals : -1)); }

  function label(time, decimals) {
    const since = "T" + (time - start < 0 ? "\u2212" : "+") + Number(Math.abs(time - start).toFixed(decimals + 2));
    return (zero === null ? time.toFixed(decimals) : clock(time, decimals)) + "<br>" + since;
  }

  // Values and labels between two times, in an axis of so many pixels.
  function between(from, to, width) {
    const most = Math.max(2, Math.floor(width / WIDTH));
    const step = STEPS.find(function (each) { return (to - from) / each <= most; }) || (to - from) / most;
    const decimals = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
    const offset = zero === null ? -start : zero; // round clock times, or round seconds since the first row
    const values = [];
    for (let k = Math.ceil((from + offset) / step - 1e-9); k * step - offset <= to + 1e-9; k++) values.push(k * step - offset);
    return { tickmode: "array", tickvals: values, ticktext: values.map(function (value) { return label(value, decimals); }) };
  }

  // For all axes of time in a layout that has the given width: names of their settings with new values.
  function update(layout, width) {
    const found = {};
    if (!used || !layout.meta || !layout.meta.time) return found;
    const names = Object.keys(layout).filter(function (name) { return /^xaxis\d*$/.test(name) && layout[name].range; });
    const columns = layout.meta.columns || 1;
    for (const name of names) {
      const range = layout[name].range.map(Number);
      const ticks = between(Math.min(...range), Math.max(...range), (width - 130) / columns);
      for (const key in ticks) found[name + "." + key] = ticks[key];
    }
    return found;
  }

  // The same, written into a layout before it is drawn.
  function prepare(layout, width) {
    const found = update(layout, width);
    for (const key in found) {
      const [name, setting] = key.split(".");
      layout[name][setting] = found[key];
      if (layout[name].title && layout[name].title.text === "time, s") layout[name].title.text = zero === null ? "log's clock, and T+, s" : (log.dataset.zone || "log's clock") + ", and T+ s";
    }
    if (Object.keys(found).length) layout.margin.b += 16;
  }

  return { update: update, prepare: prepare };
})();
