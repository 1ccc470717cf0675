/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * watch.js - the live page of `beamfit watch`: asks the server for its state, shows it, and sends what is clicked. Paths are relative, so that the
 * token stays in the address alone.
 */
'use strict';

(() => {
  const make = Explore.make, bench = document.getElementById('bench'), explore = document.getElementById('explore');
  const WAIT_MS = { busy: 150, idle: 600 };
  let state = null, version = -1, falling = [], timer = null;

  function by(id) {
    return document.getElementById(id);
  }

  async function ask(name, argument) {
    const options = argument === undefined ? {} : { method: 'POST', body: new URLSearchParams({ argument }) };
    const answer = await fetch(name, options);
    const data = await answer.json();
    if (!answer.ok)
      throw new Error(data.error || 'the server answered ' + answer.status);
    return data;
  }

  async function send(job, argument) {
    try {
      if (job !== 'stop')
        falling = [];
      await take(await ask(job, argument === undefined ? '' : String(argument)));
    } catch (error) {
      by('said').textContent = error.message;
      by('said').className = 'warning';
    }
    poll(0);
  }

  /* ---- What is shown ---- */

  function button(id, text, job, argument) {
    return make('button', { type: 'button', id, onclick: () => send(job, argument && argument()) }, text);
  }

  function recordRow(record, i) {
    const choices = ['fit', 'check', 'off'].map((use) => {
      const input = make('input', { type: 'radio', name: 'use' + i, value: use, checked: record.use === use, onchange: pick });
      input.setAttribute('aria-label', record.file + ': ' + use);
      return make('td', {}, make('label', { class: 'choice' }, input));
    });
    return make('tr', {}, make('td', {}, record.file), make('td', { class: 'n' }, String(record.samples)),
      make('td', { class: 'n' }, Curves.number(record.seconds, 3)), ...choices);
  }

  function pick() {
    send('pick', state.records.map((r, i) => {
      const use = bench.querySelector('input[name=use' + i + ']:checked').value;
      return use === 'fit' ? 'f' : use === 'check' ? 'c' : '-';
    }).join(''));
  }

  function build() {
    const heads = ['Record', 'Samples', 'Duration (s)', 'Fit', 'Held out', 'Off'].map((text, i) => make('th', { class: i === 1 || i === 2 ? 'n' : '' }, text));
    const name = make('input', { id: 'save-name', type: 'text', maxLength: 100, value: 'watched.yaml', spellcheck: false });
    name.setAttribute('aria-label', 'name of the file');
    bench.append(
      make('h2', {}, 'Records'),
      make('div', { class: 'scroll' }, make('table', { id: 'records' }, make('thead', {}, make('tr', {}, ...heads)), make('tbody', {}, ...state.records.map(recordRow)))),
      make('div', { class: 'actions' }, button('compare', 'Compare', 'compare'), button('fit', 'Fit', 'fit'), button('diagnose', 'Diagnose', 'diagnose'),
        button('undo', 'Undo', 'undo'), button('stop', 'Stop', 'stop'),
        make('span', { class: 'group' }, button('save', 'Save as', 'save', () => name.value), name)),
      make('div', { id: 'work' }, make('progress', { id: 'bar', max: 1, value: 0 }), make('span', { id: 'doing' }),
        make('span', { id: 'falling' })),
      make('p', { id: 'said', class: 'note', role: 'status' }), make('ul', { id: 'warnings', class: 'note' }),
      make('h2', {}, 'Models'),
      make('div', { class: 'scroll' }, make('table', { id: 'steps' }, make('thead', {}, make('tr', {}, ...['Model', 'Error', 'Times the noise', 'Error, held out', 'Times the noise, held out', '']
        .map((text, i) => make('th', { class: i > 0 ? 'n' : '' }, text)))), make('tbody', {}))));
  }

  /* Logarithmic: from the noise (nothing) to the largest (full). */
  function share(ratio, largest) {
    return ratio > 1 && largest > 1 ? Math.log(ratio) / Math.log(largest) : 0;
  }

  function showSteps() {
    const largest = Math.max(...state.steps.map((s) => s.noise_ratio || 1)), show = (x, scale, unit) => (x === null ? '\u2013' : Curves.number(scale * x, 3) + unit);
    by('steps').tBodies[0].replaceChildren(...state.steps.map((step) => {
      const bar = make('i', { class: 'bar' });
      bar.style.width = 8 * share(step.noise_ratio, largest) + 'rem';
      return make('tr', {}, make('td', {}, step.name), make('td', { class: 'n' }, show(step.nrmse, 100, ' %')), make('td', { class: 'n' }, show(step.noise_ratio, 1, ' \u00d7')),
        make('td', { class: 'n' }, show(step.check_nrmse, 100, ' %')), make('td', { class: 'n' }, show(step.check_noise_ratio, 1, ' \u00d7')), make('td', {}, bar));
    }));
  }

  /* The errors that the running fit has told so far, as a line that falls. */
  function showFalling() {
    const found = /error ([0-9.]+(?:e[-+]?[0-9]+)?)/.exec(state.note);
    if (found && Number(found[1]) > 0)
      falling.push(Number(found[1]));
    if (falling.length < 2) {
      by('falling').replaceChildren();
      return;
    }
    const logs = falling.map(Math.log), top = Math.max(...logs), range = top - Math.min(...logs) || 1;
    const points = logs.map((v, i) => (120 * i / (logs.length - 1)).toFixed(1) + ',' + (2 + 20 * (top - v) / range).toFixed(1)).join(' ');
    const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg'), line = document.createElementNS(svg.namespaceURI, 'polyline');
    svg.setAttribute('viewBox', '0 0 120 24');
    line.setAttribute('points', points);
    svg.append(line);
    by('falling').replaceChildren(svg);
  }

  function showWork() {
    by('work').classList.toggle('busy', state.busy);
    by('bar').value = state.busy ? state.fraction : 0;
    by('doing').textContent = state.busy ? (state.what || state.job) + (state.note ? ': ' + state.note : ' \u2026') : '';
    by('said').textContent = state.error || state.said;
    by('said').className = state.error ? 'warning' : 'note';
    by('warnings').replaceChildren(...state.warnings.map((text) => make('li', {}, text)));
    for (const id of ['compare', 'fit', 'diagnose', 'undo', 'save'])
      by(id).disabled = state.busy || (id === 'undo' && state.steps.length < 2);
    by('stop').disabled = !state.busy;
    bench.querySelectorAll('#records input').forEach((input) => { input.disabled = state.busy; });
    explore.querySelectorAll('button.add').forEach((one) => { one.disabled = state.busy; });
    showFalling();
  }

  function showVerdict() {
    const last = state.steps[state.steps.length - 1], times = (x) => Curves.number(x, 3) + ' times the noise';
    by('verdict').textContent = last.name + ' leaves ' + (last.noise_ratio !== null ? times(last.noise_ratio) + ' in the records to fit' : 'nothing known of the records to fit') +
      (last.check_noise_ratio !== null ? ', ' + times(last.check_noise_ratio) + ' in those held out.' : '.');
    document.title = last.name;
  }

  /* The end of an explanation's row: a button that adds and refits it. */
  function action(explanation, i) {
    return state.addable[i] ? make('button', { type: 'button', class: 'add', onclick: () => send('add', i) }, 'Add') : '';
  }

  function showRecords() {
    state.records.forEach((record, i) => {
      for (const input of bench.querySelectorAll('input[name=use' + i + ']'))
        input.checked = input.value === record.use;
    });
  }

  async function take(next) {
    state = next;
    if (!bench.firstChild)
      build();
    if (!state.busy)
      showRecords();
    showSteps();
    showVerdict();
    showWork();
    if (!state.busy && state.version !== version) {
      version = state.version;
      Explore.show(explore, await ask('curves'), action);
    }
  }

  /* ---- Asking again ---- */

  async function poll(soon) {
    clearTimeout(timer);
    if (soon === undefined)
      try {
        await take(await ask('state'));
        document.body.classList.remove('gone');
      } catch (error) {
        document.body.classList.add('gone');
        by('verdict').textContent = 'beamfit watch does not answer any more (' + error.message + '). Was it ended?';
      }
    timer = setTimeout(poll, soon !== undefined ? soon : state && state.busy ? WAIT_MS.busy : WAIT_MS.idle);
  }

  poll();
})();
