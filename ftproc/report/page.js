"use strict";
// Draws the figures one after the other, and again in the width of the paper for printing.
(function () {
  const PAPER = 680; // CSS pixels between the margins of an A4 or Letter page
  const LOWER = 0.7; // of the height, so that two figures share a page
  const config = { displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
  const places = Array.from(document.querySelectorAll("figure"));

  function draw(index) {
    if (index === places.length) {
      document.body.dataset.drawn = "yes";
      return;
    }
    const place = places[index];
    const data = document.querySelector('script[data-figure="' + place.id + '"]');
    const figure = JSON.parse(data.textContent);
    Plotly.newPlot(place, figure.data, figure.layout, config).then(function () {
      requestAnimationFrame(function () { draw(index + 1); });
    });
  }

  addEventListener("beforeprint", function () {
    places.forEach(function (place) {
      const height = LOWER * parseInt(place.dataset.height, 10);
      place.style.height = height + "px";
      Plotly.relayout(place, { width: PAPER / place.parentNode.querySelectorAll("figure").length, height: height, autosize: false });
    });
  });
  addEventListener("afterprint", function () {
    places.forEach(function (place) {
      const height = parseInt(place.dataset.height, 10);
      place.style.height = height + "px";
      Plotly.relayout(place, { width: null, height: height, autosize: true });
    });
  });
  draw(0);
})();
