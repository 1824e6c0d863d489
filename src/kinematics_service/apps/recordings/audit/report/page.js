/*
SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
SPDX-License-Identifier: Apache-2.0
*/
const plots = [...document.querySelectorAll('.plot')].map(box => ({box,
  svg: box.querySelector('svg'), cursor: box.querySelector('.cursor'),
  read: box.querySelector('.read'), paths: null}));
function points(path) {
  return path.getAttribute('d').split(/(?=[ML])/).map(p => p.slice(1).split(' ').map(Number));
}
function value(plot, points, x) {
  let best = null, off = 1e9;
  for (const [px, py] of points) {
    const d = Math.abs(px - x);
    if (d < off) { off = d; best = py; }
  }
  if (best === null || off > 12) return '';
  const {low, high, log} = plot.svg.dataset, f = 1 - best / 100;
  const v = log ? low * Math.pow(high / low, f) : +low + f * (high - low);
  return (best === 0 ? '> ' : '') + Number(v.toPrecision(3)).toString();
}
function show(fraction, own) {
  for (const plot of plots) {
    const x = 1000 * fraction;
    plot.cursor.setAttribute('x1', x); plot.cursor.setAttribute('x2', x);
    plot.cursor.style.visibility = 'visible';
    plot.read.style.display = plot === own ? 'block' : 'none';
    if (plot !== own) continue;
    plot.paths ??= [...plot.svg.querySelectorAll('path[data-name]')]
      .map(p => [p.dataset.name, points(p)]);
    const t = fraction * plot.svg.dataset.end;
    plot.read.textContent = 't ' + Number(t.toPrecision(4)) + ' ' + plot.svg.dataset.unit + '   '
      + plot.paths.map(([name, p]) => name + ' ' + value(plot, p, x)).join('   ');
    plot.read.style.left = fraction < .5 ? 'auto' : '.4rem';
    plot.read.style.right = fraction < .5 ? '.4rem' : 'auto';
  }
}
for (const plot of plots) {
  plot.box.addEventListener('pointermove', e => {
    const r = plot.svg.getBoundingClientRect();
    show(Math.min(1, Math.max(0, (e.clientX - r.left) / r.width)), plot);
  });
  plot.box.addEventListener('pointerleave', () => plots.forEach(p => {
    p.cursor.style.visibility = 'hidden'; p.read.style.display = 'none'; }));
}
