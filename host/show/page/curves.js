/* SPDX-License-Identifier: GPL-3.0-or-later */
/* curves.js - the curves of host/show/curves.c as numbers. A grid has segments of samples; a curve has 16-bit numbers and a scale. */
'use strict';

const Curves = (() => {
  const NO_VALUE = -32768;

  /* Abscissae of a grid's points: start + step * sample. */
  function abscissae(grid, start, step) {
    const x = [];
    for (const segment of grid)
      for (let i = 0; i < segment.n; i++)
        x.push(start + step * (segment.first + i * segment.step));
    return x;
  }

  /* Values of a curve, null where there is none; amplitudes of decibels where asked. */
  function values(curve, decibels) {
    if (!curve)
      return [];
    const bytes = Uint8Array.from(atob(curve.data), (c) => c.charCodeAt(0));
    const numbers = new DataView(bytes.buffer), y = new Array(bytes.length / 2);
    for (let i = 0; i < y.length; i++) {
      const n = numbers.getInt16(2 * i, true);
      y[i] = n === NO_VALUE ? null : decibels ? Math.pow(10, curve.scale * n / 20) : curve.scale * n;
    }
    return y;
  }

  /* Prefix of a unit that makes `largest` a number from 1 to 1000, and the factor of its values. */
  function prefix(largest, unit) {
    const takes = /^(V|N|m|rad|Pa|A|W|J|K)([/·].*)?$/.test(unit || '');
    if (!takes || !(largest > 0) || !isFinite(largest))
      return { factor: 1, unit: unit || '' };
    const steps = Math.max(-5, Math.min(2, Math.floor(Math.log10(largest * 1.0005) / 3)));
    return { factor: Math.pow(10, -3 * steps), unit: ['f', 'p', 'n', '\u00b5', 'm', '', 'k', 'M'][steps + 5] + unit };
  }

  /* A number of an axis or of a legend: few digits, a true minus. */
  function number(x, digits) {
    if (x === null || x === undefined || !isFinite(x))
      return '\u2013';
    const size = Math.abs(x);
    const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? x.toExponential(Math.max(0, (digits || 3) - 1))
      : String(Number(x.toPrecision(digits || 3)));
    return text.replace('-', '\u2212').replace(/e[+]?(\S)0*(\d*)$/, 'e$1$2').replace('e-', 'e\u2212');
  }

  function largest(list) {
    let most = 0;
    for (const y of list)
      for (const v of y)
        if (v !== null && Math.abs(v) > most)
          most = Math.abs(v);
    return most;
  }

  return { abscissae, values, prefix, number, largest };
})();
