// Charts below each other with one x axis, one legend, one view and one cursor: a grid of a figure.
"use strict";
const PyroshockStack = (() => {
  const { html } = pyroshockMarks;
  let stacks = 0;

  return class {
    constructor(element) {
      this.element = element;
      this.group = element.dataset.link || `stack-${(stacks += 1)}`;
      this.charts = [];
      this.rows = html("div", "rows");
      this.status = html("p", "unseen");
      this.status.setAttribute("role", "status");
    }

    show(grid) {
      this.figure = grid;
      this.element.data = grid.rows.flatMap((row) => row.series);
      if (this.charts.length !== grid.rows.length) this.build(grid.rows.length);
      // the first chart has the legend of all
      grid.rows.forEach((row, i) => this.charts[i].show({ ...row, legend: i ? [] : grid.legend }));
      this.hideAlike();
      this.element.dataset.drawn = "yes";
    }

    build(count) {
      this.charts = [];
      this.rows.replaceChildren();
      for (let i = 0; i < count; i += 1) {
        const place = html("div", "row-plot");
        place.dataset.link = this.group;
        this.rows.append(place);
        const chart = new PyroshockChart(place, { stack: this, inner: i < count - 1 });
        place.chart = chart;
        this.charts.push(chart);
      }
      this.element.replaceChildren(this.charts[0].legend, this.rows, this.status);
      this.charts[0].element.addEventListener("viewed", () => this.hideAlike());
    }

    // Names of the legend are hidden in every chart.
    hideAlike() {
      const [first, ...others] = this.charts;
      others.forEach((chart) => {
        if (chart.hidden.size === first.hidden.size && [...first.hidden].every((name) => chart.hidden.has(name)))
          return;
        chart.hidden = new Set(first.hidden);
        chart.paint();
      });
    }

    // All frames begin at the same pixel, so that the cursor is one line.
    align(painted) {
      const leftmost = Math.max(...this.charts.map((chart) => chart.wanted || 0));
      this.charts
        .filter((chart) => chart.drawing && chart.leftmost !== leftmost)
        .forEach((chart) => {
          chart.leftmost = leftmost;
          if (chart !== painted || chart.frame.left !== leftmost) chart.paint();
        });
    }

    get range() {
      return this.charts[0].range;
    }
    zoom(view) {
      this.charts[0].zoom(view);
    }
    zoomBy(factor) {
      this.charts[0].zoomBy(factor);
    }
    everything() {
      this.see({ x: null, y: null });
    }
    // What the page opens with.
    home() {
      this.see(this.charts[0].firstView());
    }
    see({ x, y }) {
      const [first, ...others] = this.charts;
      others.filter((chart) => chart.view.y).forEach((chart) => chart.zoom({ y: null }));
      first.zoom({ x, y });
    }
  };
})();
