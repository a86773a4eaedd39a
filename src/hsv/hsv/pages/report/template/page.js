"use strict";
/* The controls of the page, and its start. */

async function start() {
  const plots = JSON.parse(document.getElementById("plots").textContent);
  await startCharts(plots, (charts) => {
    const form = document.getElementById("toolbar");
    charts.player = new Player(charts, plots);
    connectCharts(charts, form, (time) => {
      showUnits();
      followToolbar(charts, form, time);
      charts.player.setUnits(form.elements.units.value);
    });
  });
}

start();
