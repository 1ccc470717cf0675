/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * explore.js - the curves of a model's records: what is shown of them, which two explanations are compared, and the charts of every channel.
 * Explore.show(element, data) with the data of host/show/curves.c; again with newer data.
 */
'use strict';

const Explore = (() => {
  const shown = { measured: true, model: true, residual: true, noise: true };
  let root = null, data = null, before = 0, after = 0, charts = [], actions = null;

  function make(tag, options, ...children) {
    const element = document.createElement(tag);
    for (const [key, value] of Object.entries(options || {}))
      if (key === 'class')
        element.className = value;
      else if (key.startsWith('on'))
        element.addEventListener(key.slice(2), value);
      else if (key in element && key !== 'list')
        element[key] = value;
      else
        element.setAttribute(key, value);
    element.append(...children.filter((c) => c !== null));
    return element;
  }

  /* ---- What a chart is made of ---- */

  function compares() {
    return data.explanations.length > 1 && before !== after;
  }

  function pair(list, decibels) { /* before only where it is another model */
    const curves = compares() ? [{ name: 'before', y: Curves.values(list[before], decibels) }] : [];
    return curves.concat([{ name: 'model', y: Curves.values(list[after], decibels) }]);
  }

  /* Predicted is measured less residual where every sample is there; else it has curves of its own. */
  function predicted(t, measured) {
    if (t.model.length)
      return pair(t.model);
    const curves = pair(t.residual);
    for (const curve of curves)
      curve.y = curve.y.map((v, i) => (v === null || measured[i] === null ? null : measured[i] - v));
    return curves;
  }

  /* Where a curve is not whole: said, with where it is. */
  function thinned(channel) {
    const said = [];
    for (const [grid, what] of [[channel.time.grid, 'samples'], [channel.frequency.grid, 'lines']]) {
      const last = grid && grid[grid.length - 1], coarse = grid && Math.max(...grid.map((s) => s.step));
      if (coarse > 1)
        said.push('of ' + (last.first + last.n * last.step) + ' ' + what + ' the smallest and the largest of every ' + 2 * coarse +
          (grid.length > 1 ? ', all of them in one part' : ''));
    }
    return said.length ? 'The curves here have ' + said.join('; ') + '. beamfit watch shows all.' : '';
  }

  function scaled(curves, factor) {
    for (const curve of curves)
      curve.y = curve.y.map((v) => (v === null ? null : v * factor));
    return curves;
  }

  /* No line from 180 to -180 degrees. */
  function broken(curves) {
    for (const curve of curves)
      curve.y = curve.y.map((v, i, y) => (i > 0 && v !== null && y[i - 1] !== null && Math.abs(v - y[i - 1]) > 180 ? null : v));
    return curves;
  }

  function hide(curves) {
    for (const curve of curves)
      curve.hidden = !shown[curve.name === 'before' ? 'model' : curve.name];
    return curves;
  }

  function asResidual(curves) {
    for (const curve of curves)
      if (curve.name === 'model')
        curve.name = 'residual';
    for (const curve of curves)
      curve.hidden = curve.name === 'noise' && !shown.noise;
    return curves;
  }

  function timeSpecs(channel) {
    const t = channel.time, x = Curves.abscissae(t.grid, t.start_s, t.step_s), xLabel = 'time (s)';
    const measured = Curves.values(t.measured), curves = [{ name: 'measured', y: measured }].concat(predicted(t, measured));
    const left = asResidual(pair(t.residual));
    const big = Curves.prefix(Curves.largest(curves.map((c) => c.y)), channel.unit);
    const small = Curves.prefix(Curves.largest(left.map((c) => c.y)), channel.unit);
    const group = 'time ' + channel.record;
    return [
      { kind: 'time', x, xLabel, xUnit: 's', yLabel: big.unit, curves: hide(scaled(curves, big.factor)), group, label: 'measured and predicted over time' },
      { kind: 'time-residual', x, xLabel, xUnit: 's', yLabel: 'residual (' + (small.unit || '1') + ')', curves: scaled(left, small.factor), group,
        band: shown.noise && t.noise_rms ? 2 * t.noise_rms * small.factor : 0, label: 'residual over time' },
    ];
  }

  /* Of a logarithmic axis: from well below the noise, or six decades, to above the largest. */
  function logRange(lists, noise) {
    const top = Curves.largest(lists), least = noise.filter((v) => v > 0);
    const bottom = least.length ? Math.min(...least) / 4 : top / 1e6;
    return top > 0 ? [Math.max(bottom, top / 1e9), 2 * top] : null;
  }

  function frequencySpecs(channel) {
    const f = channel.frequency;
    if (!f.grid)
      return [];
    const x = Curves.abscissae(f.grid, 0, f.step_Hz), xLabel = 'frequency (Hz)', xUnit = 'Hz', group = 'frequency';
    const noise = Curves.values(f.noise, true), home = [0, f.show_to_Hz > 0 ? f.show_to_Hz : x[x.length - 1]];
    const magnitude = [{ name: 'measured', y: Curves.values(f.measured, true) }].concat(pair(f.model, true), [{ name: 'noise', y: noise }]);
    const left = asResidual(pair(f.residual, true).concat([{ name: 'noise', y: noise }]));
    const response = f.kind === 'response', unit = f.unit || channel.unit || '1';
    const specs = [{ kind: 'magnitude', x, xLabel, xUnit, home, group, log: true, yLabel: unit, curves: hide(magnitude),
      range: logRange(magnitude.map((c) => c.y), noise), label: response ? 'magnitude of the frequency response' : 'amplitude spectrum' }];
    if (response)
      specs.push({ kind: 'phase', x, xLabel, xUnit, home, group, yLabel: 'phase (\u00b0)', range: [-190, 190], ticks: [-180, -90, 0, 90, 180],
        curves: broken(hide([{ name: 'measured', y: Curves.values(f.phase) }].concat(pair(f.model_phase)))), label: 'phase of the frequency response' });
    specs.push({ kind: 'frequency-residual', x, xLabel, xUnit, home, group, log: true, yLabel: 'residual (' + unit + ')', curves: left,
      range: logRange(left.map((c) => c.y), noise), label: 'residual over frequency' });
    return specs;
  }

  function specsOf(channel) {
    return timeSpecs(channel).concat(frequencySpecs(channel));
  }

  /* ---- Channels ---- */

  function errorText(channel) {
    const say = (i) => Curves.number(100 * channel.nrmse[i], 3) + ' %, ' + Curves.number(channel.noise_ratio[i], 3) + ' times the noise';
    return (compares() ? 'Before: ' + say(before) + '. After: ' : 'Error ') + say(after) + '.';
  }

  function addChannel(channel, index) {
    const section = make('section', { class: 'channel', id: 'channel' + index },
      make('h3', {}, channel.record + ', ' + channel.name + (channel.held_out ? ' (held out)' : '')),
      make('p', { class: 'error note' }, errorText(channel)));
    for (const spec of specsOf(channel)) {
      const host = make('div', { class: 'chart ' + spec.kind });
      section.append(host);
      charts.push({ channel, kind: spec.kind, chart: new Chart.One(host, spec) });
    }
    section.append(make('p', { class: 'note' }, channel.text), make('p', { class: 'note thinned' }, thinned(channel)));
    return section;
  }

  /* Other curves in the same charts. */
  function update() {
    const made = new Map();
    root.classList.toggle('no-residual', !shown.residual);
    root.querySelector('#wipe').hidden = !compares();
    for (const one of charts) {
      if (!made.has(one.channel))
        made.set(one.channel, specsOf(one.channel));
      one.chart.spec = made.get(one.channel).find((spec) => spec.kind === one.kind);
      one.chart.refresh();
    }
    data.channels.forEach((channel, i) => { root.querySelector('#channel' + i + ' .error').textContent = errorText(channel); });
    root.querySelectorAll('#explanations tbody tr').forEach((row, i) => {
      row.classList.toggle('before', i === before && compares());
      row.classList.toggle('after', i === after);
      row.querySelector('[name=before]').checked = i === before;
      row.querySelector('[name=after]').checked = i === after;
    });
  }

  /* ---- Controls ---- */

  function toggle(name) {
    return make('label', {}, make('input', { type: 'checkbox', id: 'show-' + name, checked: shown[name],
      onchange: (event) => { shown[name] = event.target.checked; update(); } }), make('i', { class: 'swatch ' + name }), name);
  }

  function mode(name, text) {
    return make('label', {}, make('input', { type: 'radio', name: 'drag', id: 'drag-' + name, checked: Chart.state.mode === name,
      onchange: () => { Chart.state.mode = name; } }), text);
  }

  function controls() {
    const slider = make('input', { type: 'range', id: 'split', min: 0, max: 1000, value: 1000 * Chart.state.split,
      oninput: (event) => Chart.setSplit(event.target.value / 1000) });
    slider.setAttribute('aria-label', 'left of it the model before, right of it the model after');
    return make('div', { class: 'controls' },
      make('span', { class: 'group' }, toggle('measured'), toggle('model'), toggle('residual'), toggle('noise')),
      make('span', { class: 'group', id: 'wipe' }, make('label', {}, 'before', slider, 'after')),
      make('span', { class: 'group' }, 'drag:', mode('zoom', 'zoom'), mode('pan', 'pan'),
        make('button', { type: 'button', id: 'reset', onclick: () => Chart.reset() }, 'whole')));
  }

  function cell(text) {
    return make('td', { class: 'n' }, text);
  }

  function choice(name, i) {
    const input = make('input', { type: 'radio', name, checked: i === (name === 'before' ? before : after),
      onchange: () => { choose(name, i); } });
    input.setAttribute('aria-label', name + ': ' + data.explanations[i].name);
    return make('td', {}, make('label', { class: 'choice' }, input));
  }

  function choose(name, i) {
    if (name === 'before')
      before = i;
    else
      after = i;
    update();
  }

  function explanationRow(e, i) {
    const percent = (x) => (x === null ? '\u2013' : x < 1e-3 ? '< 0.1 %' : Curves.number(100 * x, 3) + ' %'), times = (x) => (x === null ? '\u2013' : Curves.number(x, 3) + ' \u00d7');
    const row = make('tr', { onclick: (event) => { if (!event.target.closest('input, label, button')) choose('after', i); } },
      choice('before', i), choice('after', i), make('td', {}, e.name),
      cell(percent(e.nrmse)), cell(times(e.noise_ratio)), cell(percent(e.check_nrmse)), cell(times(e.check_noise_ratio)),
      cell(percent(e.probability)), cell(percent(e.explained)));
    if (actions)
      row.append(make('td', {}, actions(e, i)));
    return row;
  }

  function table() {
    const heads = ['Before', 'After', 'Explanation', 'Error', 'Times the noise', 'Error, held out', 'Times the noise, held out', 'Probability', 'Explains'];
    const head = make('tr', {}, ...heads.map((text, i) => make('th', { class: i > 2 ? 'n' : '' }, text)));
    if (actions)
      head.append(make('th', {}, ''));
    return make('div', { class: 'scroll' }, make('table', { id: 'explanations' }, make('thead', {}, head),
      make('tbody', {}, ...data.explanations.map(explanationRow))));
  }

  /* actions(explanation, index): an element for the end of its row, or null. */
  function show(element, newData, newActions) {
    root = element;
    data = newData;
    actions = newActions || null;
    before = data.before;
    after = data.after;
    charts = [];
    Chart.forget();
    root.textContent = '';
    root.append(table(), make('p', { class: 'note hint' }, 'A click on a row shows its curves. Drag in a chart to zoom (or pan); double click for the whole; ' +
      'with two fingers on a screen; + \u2212 \u2190 \u2192 0 on a keyboard. Charts of one record share their time, all charts their frequency.'),
    controls(), ...data.channels.map(addChannel));
    update();
  }

  return { show, make, current: () => ({ before, after }) };
})();
