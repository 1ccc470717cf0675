/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * chart.js - one chart of dygraphs: its curves, its zoom, which it shares with the other charts of its group, and the slider that divides it into
 * before (left) and after (right).
 */
'use strict';

const Chart = (() => {
  const groups = new Map(); /* name -> {charts: Set, window: [from, to] or null, home: the window to return to} */
  const state = { split: 0, mode: 'zoom', printing: false };
  const NAMES = { measured: 'measured', before: 'before', model: 'model', residual: 'residual', noise: 'noise' };

  function group(name) {
    if (!groups.has(name))
      groups.set(name, { charts: new Set(), window: null, home: null });
    return groups.get(name);
  }

  function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  }

  /* Draws the line only left (of before) or right (of after) of the slider. */
  function wiping(side) {
    return (e) => {
      const area = e.plotArea, edge = area.x + area.w * state.split, ctx = e.drawingContext;
      ctx.save();
      ctx.beginPath();
      if (side === 'before')
        ctx.rect(area.x, area.y, edge - area.x, area.h);
      else
        ctx.rect(edge, area.y, area.x + area.w - edge, area.h);
      ctx.clip();
      Dygraph.Plotters.linePlotter(e);
      ctx.restore();
    };
  }

  function drawUnderlay(spec) {
    return (ctx, area, g) => {
      if (spec.band) { /* two standard deviations of the noise */
        const top = g.toDomYCoord(spec.band), bottom = g.toDomYCoord(-spec.band);
        ctx.fillStyle = colour('band');
        ctx.fillRect(area.x, Math.max(top, area.y), area.w, Math.min(bottom, area.y + area.h) - Math.max(top, area.y));
      }
      if (state.split > 0 && spec.curves.some((c) => c.name === 'before')) {
        ctx.strokeStyle = colour('quiet');
        ctx.setLineDash([3, 3]);
        ctx.beginPath();
        ctx.moveTo(area.x + area.w * state.split, area.y);
        ctx.lineTo(area.x + area.w * state.split, area.y + area.h);
        ctx.stroke();
        ctx.setLineDash([]);
      }
    };
  }

  /* What is before has its part of the chart, and its say in the axis, as soon as the slider has left the end. */
  function visibility(spec) {
    return spec.curves.map((c) => !c.hidden && (c.name !== 'before' || state.split > 0));
  }

  function rows(spec) {
    return spec.x.map((x, i) => [x].concat(spec.curves.map((c) => (i < c.y.length ? c.y[i] : null))));
  }

  function seriesOptions(spec) {
    const series = {};
    for (const curve of spec.curves) {
      series[curve.name] = { color: colour(curve.colour || curve.name), strokeWidth: curve.name === 'measured' ? 1.5 : 1.3 };
      if (curve.name === 'before')
        series[curve.name].plotter = wiping('before');
      if (curve.name === 'model' || curve.name === 'residual')
        series[curve.name].plotter = wiping('after');
      if (curve.name === 'model')
        series[curve.name].strokePattern = [5, 3];
      if (curve.name === 'noise')
        series[curve.name].strokePattern = [2, 3];
    }
    return series;
  }

  /* What is under the pointer, for a person; names are this file's own. */
  function legend(spec) {
    return (data) => {
      const parts = data.series.filter((s) => s.isVisible).map((s) => {
        const value = data.x === undefined || s.y === undefined || s.y === null ? '' : ' ' + Curves.number(s.y, 4);
        return '<span class="key"><i style="background:' + s.color + '"></i>' + NAMES[s.label] + value + '</span>';
      });
      const at = data.x === undefined ? '' : '<span class="key">' + Curves.number(data.x, 5) + ' ' + spec.xUnit + '</span>';
      return parts.join('') + at;
    };
  }

  /* A chart takes a touch only with two fingers: with one the page scrolls. */
  function interaction() {
    const usual = Dygraph.defaultInteractionModel;
    return Object.assign({}, usual, {
      mousedown: (event, g, context) => {
        if (state.mode === 'pan') /* what dygraphs pans with */
          Object.defineProperty(event, 'shiftKey', { value: !event.shiftKey });
        usual.mousedown(event, g, context);
      },
      touchstart: (event, g, context) => { if (event.touches.length > 1) usual.touchstart(event, g, context); },
    });
  }

  function logTicks(min, max) {
    const ticks = [], decades = Math.log10(max / min), every = Math.max(1, Math.ceil(decades / 6));
    for (let k = Math.ceil(Math.log10(min)); k <= Math.floor(Math.log10(max)); k++)
      if (k % every === 0) {
        const step = Math.floor(k / 3), letter = ['f', 'p', 'n', '\u00b5', 'm', '', 'k', 'M', 'G'][step + 5];
        ticks.push({ v: Math.pow(10, k), label: letter === undefined ? '1e' + k : Math.pow(10, k - 3 * step) + (letter ? '\u2009' + letter : '') });
      }
    return ticks;
  }

  class One {
    /* host: an element; spec: {x, xLabel, xUnit, yLabel, curves: [{name, y}], log, range, band, group, label} */
    constructor(host, spec) {
      this.host = host;
      this.spec = spec;
      this.group = group(spec.group);
      this.group.charts.add(this);
      if (spec.home && (!this.group.home || spec.home[1] > this.group.home[1]))
        this.group.home = spec.home;
      host.tabIndex = 0;
      host.setAttribute('role', 'img');
      host.setAttribute('aria-label', spec.label);
      host.addEventListener('keydown', (event) => this.key(event));
      this.seen = false;
      this.watcher = new IntersectionObserver((entries) => this.noticed(entries), { rootMargin: '300px' });
      this.watcher.observe(host);
    }

    noticed(entries) {
      this.seen = entries[entries.length - 1].isIntersecting;
      if (this.seen)
        this.draw();
    }

    options() {
      const spec = this.spec, wide = this.host.clientWidth > 600;
      return {
        labels: ['x'].concat(spec.curves.map((c) => c.name)), series: seriesOptions(spec),
        visibility: visibility(spec), xlabel: spec.xLabel, ylabel: spec.yLabel, labelsDiv: this.legendDiv,
        legend: 'always', legendFormatter: legend(spec), logscale: Boolean(spec.log), connectSeparatedPoints: false,
        valueRange: spec.range || null, dateWindow: this.group.window || this.group.home, pixelRatio: Math.max(2, window.devicePixelRatio || 1),
        gridLineColor: colour('line'), axisLineColor: colour('quiet'), axisLineWidth: 1, gridLineWidth: 0.5,
        interactionModel: interaction(), underlayCallback: drawUnderlay(spec), highlightCircleSize: 3, yRangePad: 6,
        drawCallback: (g, initial) => { if (!initial) this.moved(g); }, zoomCallback: null, titleHeight: 0, xLabelHeight: 20, yLabelWidth: 20,
        axes: {
          x: { axisLabelFormatter: (v) => Curves.number(v, 4), valueFormatter: (v) => v, pixelsPerLabel: wide ? 90 : 60, drawGrid: true },
          y: { axisLabelFormatter: (v) => Curves.number(v, 3), valueFormatter: (v) => v, axisLabelWidth: 52, pixelsPerLabel: 24,
            ticker: spec.ticks ? () => spec.ticks.map((v) => ({ v, label: Curves.number(v) }))
              : spec.log ? (min, max) => logTicks(min, max) : Dygraph.numericTicks },
        },
      };
    }

    draw() {
      if (this.graph) {
        if (this.stale)
          this.refresh();
        return;
      }
      this.host.textContent = '';
      this.legendDiv = document.createElement('div');
      this.legendDiv.className = 'keys';
      const plot = document.createElement('div');
      plot.className = 'plot';
      this.host.append(this.legendDiv, plot);
      this.graph = new Dygraph(plot, rows(this.spec), this.options());
      this.stale = false;
    }

    /* After other curves, a slider, a zoom elsewhere, another theme; at once when it is seen, else when it will be. */
    refresh() {
      this.stale = true;
      if (!this.graph || !(this.seen || state.printing))
        return;
      this.stale = false;
      this.busy = true;
      const options = this.options();
      delete options.drawCallback;
      this.graph.updateOptions(Object.assign(options, { file: rows(this.spec) }));
      this.busy = false;
    }

    /* Only what the slider and the windows change. */
    redraw(change) {
      this.stale = true;
      if (!this.graph || !this.seen)
        return;
      this.stale = false;
      this.busy = true;
      this.graph.updateOptions(change);
      this.busy = false;
    }

    moved(g) {
      if (this.busy)
        return;
      const at = g.xAxisRange(), was = this.group.window || [];
      if (Math.abs(at[0] - was[0]) < 1e-12 && Math.abs(at[1] - was[1]) < 1e-12)
        return;
      this.group.window = at;
      for (const other of this.group.charts)
        if (other !== this)
          other.redraw({ dateWindow: at });
    }

    zoom(factor, shift) {
      if (!this.graph)
        return;
      const [a, b] = this.graph.xAxisRange(), middle = (a + b) / 2 + shift * (b - a), half = (b - a) / 2 * factor;
      this.graph.updateOptions({ dateWindow: [middle - half, middle + half] });
    }

    key(event) {
      const does = { '+': [0.5, 0], '=': [0.5, 0], '-': [2, 0], ArrowLeft: [1, -0.2], ArrowRight: [1, 0.2] }[event.key];
      if (event.key === '0')
        reset(this.spec.group);
      else if (does)
        this.zoom(does[0], does[1]);
      else
        return;
      event.preventDefault();
    }

    remove() {
      this.watcher.disconnect();
      this.group.charts.delete(this);
      if (this.graph)
        this.graph.destroy();
    }
  }

  /* The whole again, of one group or of all. */
  function reset(name) {
    for (const [key, one] of groups)
      if (name === undefined || key === name) {
        one.window = null;
        for (const chart of one.charts)
          chart.redraw({ dateWindow: one.home, valueRange: chart.spec.range || null });
      }
  }

  function each(call) {
    for (const one of groups.values())
      for (const chart of one.charts)
        call(chart);
  }

  function setSplit(split) {
    state.split = split;
    each((chart) => chart.redraw({ visibility: visibility(chart.spec) }));
  }

  /* The chart as a picture: canvases that change while the page is laid out for paper are not printed. */
  function picture(chart) {
    const canvases = [...chart.host.querySelectorAll('canvas')], whole = document.createElement('canvas'), img = new Image();
    whole.width = canvases[0].width;
    whole.height = canvases[0].height;
    for (const canvas of canvases)
      whole.getContext('2d').drawImage(canvas, 0, 0, whole.width, whole.height);
    img.className = 'printed';
    img.decoding = 'sync';
    img.alt = chart.spec.label;
    img.src = whole.toDataURL();
    canvases[0].parentNode.prepend(img);
  }

  function forPrint(printing) {
    if (printing === state.printing)
      return;
    state.printing = printing;
    document.documentElement.classList.toggle('printing', printing);
    each((chart) => {
      chart.host.querySelectorAll('img.printed').forEach((img) => img.remove());
      if (printing)
        chart.draw();
      chart.refresh();
      if (chart.graph)
        chart.graph.resize();
      if (printing)
        picture(chart);
    });
  }

  function forget() {
    each((chart) => chart.remove());
    for (const one of groups.values())
      one.home = null;
  }

  window.addEventListener('beforeprint', () => forPrint(true));
  window.addEventListener('afterprint', () => forPrint(false));
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => each((chart) => chart.refresh()));

  return { One, state, reset, each, setSplit, forget, forPrint };
})();
