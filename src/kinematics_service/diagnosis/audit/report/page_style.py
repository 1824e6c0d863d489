"""Style and script of the audit page: light, dark and printed, at any width, without a network."""

# Colours of Okabe and Ito (2008), told apart by all kinds of colour vision; lighter in the dark.
STYLE = """
:root { color-scheme: light dark; --paper: #fff; --ink: #1b1b1b; --soft: #5c5c5c; --rule: #d0d0d0;
  --panel: #f6f6f6; --c0: #0072b2; --c1: #d55e00; --c2: #00795a; --c3: #a8487f; --c4: #7a6a00;
  --c5: #444; --warn: #e69f00; --stop: #d55e00; --fine: #00795a; --gap: #808080; }
@media screen and (prefers-color-scheme: dark) {
  :root { --paper: #16181a; --ink: #e8e8e8; --soft: #a8a8a8; --rule: #3a3d40; --panel: #1f2224;
    --c0: #56b4e9; --c1: #ff8c42; --c2: #2fc79b; --c3: #e39ac4; --c4: #e5d84a; --c5: #c8c8c8;
    --fine: #2fc79b; --stop: #ff7a2f; } }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 68rem; margin: 1.5rem auto;
  padding: 0 1rem; color: var(--ink); background: var(--paper); }
h1 { font-size: 1.45rem; margin: 0 0 .2rem; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid var(--rule); }
p { margin: .4rem 0; } .soft { color: var(--soft); }
.verdict { border: 2px solid; border-left-width: .6rem; border-radius: .3rem; padding: .6rem 1rem;
  margin: 1rem 0; background: var(--panel); }
.verdict.OK { border-color: var(--fine); } .verdict.WARN { border-color: var(--warn); }
.verdict.ERROR { border-color: var(--stop); }
.verdict p.first { font-size: 1.15rem; font-weight: 600; }
.verdict ul { margin: .4rem 0 0; padding-left: 1.2rem; }
dl.origin { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: .15rem 1rem;
  margin: .6rem 0; padding: .5rem 0; border-top: 1px solid var(--rule);
  border-bottom: 1px solid var(--rule); font-size: .92rem; }
dt { color: var(--soft); } dd { margin: 0; overflow-wrap: anywhere; }
.tag { font-weight: 700; font-size: .85em; white-space: nowrap; padding-right: .3rem; }
.tag.OK { color: var(--fine); } .tag.ERROR { color: var(--stop); }
.tag.WARN { color: var(--ink); border-bottom: 3px solid var(--warn); padding: 0;
  margin-right: .3rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .92rem; }
th, td { text-align: left; padding: .22rem .9rem .22rem 0; vertical-align: top; }
thead th { border-bottom: 1px solid var(--rule); font-weight: 600; vertical-align: bottom; }
td.n, th.n { text-align: right; }
td.n, td:first-child { white-space: nowrap; }
td.t { white-space: nowrap; }
figure { margin: .2rem 0 1.7rem; break-inside: avoid; }
figcaption { font-size: .92rem; margin-bottom: .25rem; padding-top: .5rem; }
figcaption .key { white-space: nowrap; margin-left: .9rem; }
figcaption svg { width: 1.8rem; height: .7rem; vertical-align: middle; margin-right: .25rem; }
.plot { position: relative; margin: 0 .6rem 0 4rem; height: var(--height, 150px); }
.plot > svg { position: absolute; inset: 0; width: 100%; height: 100%; overflow: hidden;
  border: 1px solid var(--rule); }
.plot span { position: absolute; font-size: .78rem; color: var(--soft); line-height: 1;
  white-space: nowrap; }
.plot .y { right: calc(100% + .35rem); transform: translateY(-50%); }
.plot .x { top: calc(100% + .3rem); transform: translateX(-50%); }
.plot .x.unit { left: auto; right: 0; transform: none; }
.plot .note { left: .4rem; transform: translateY(-115%); background: var(--paper); opacity: .9;
  padding: 0 .15rem; }
.plot .read { display: none; color: var(--ink); background: var(--panel); top: .3rem;
  padding: .25rem .4rem; border: 1px solid var(--rule); z-index: 2; pointer-events: none; }
path, line { vector-effect: non-scaling-stroke; fill: none; stroke-width: 1.4; }
.grid { stroke: var(--rule); stroke-width: 1; }
.c0 { stroke: var(--c0); } .c1 { stroke: var(--c1); stroke-dasharray: 7 3; }
.c2 { stroke: var(--c2); stroke-dasharray: 2 2; }
.c3 { stroke: var(--c3); stroke-dasharray: 9 3 2 3; }
.c4 { stroke: var(--c4); stroke-dasharray: 12 4; }
.c5 { stroke: var(--c5); stroke-dasharray: 4 2 1 2; }
.solid { stroke-dasharray: none; }
.limit { stroke: var(--stop); stroke-dasharray: 6 4; }
.warnline { stroke: var(--warn); stroke-dasharray: 6 4; }
.cursor { stroke: var(--soft); stroke-width: 1; visibility: hidden; }
rect.WARN { fill: var(--warn); opacity: .22; }
rect.ERROR { fill: var(--stop); opacity: .42; }
rect.gap { fill: var(--gap); opacity: .25; }
.joints { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr));
  gap: 0 1rem; }
.swatch { padding: 0 .5rem; margin-right: .3rem; border: 1px solid var(--rule);
  color: var(--ink); }
.swatch.WARN { background: color-mix(in srgb, var(--warn) 25%, transparent); }
.swatch.ERROR { background: color-mix(in srgb, var(--stop) 45%, transparent); }
.swatch.gap { background: color-mix(in srgb, var(--gap) 30%, transparent); }
td:last-child { min-width: 9rem; }
code { font-size: .9em; overflow-wrap: anywhere; }
@media (max-width: 40rem) { .plot { margin-left: 3.2rem; } figcaption .key { margin-left: .4rem; }
  .plot .note { max-width: 60%; } body { padding: 0 .6rem; overflow-wrap: anywhere; } }
@page { size: A4; margin: 14mm 12mm 16mm; }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 9.5pt; }
  .wide { overflow: visible; } table { font-size: 7.5pt; }
  th, td { padding-right: .5rem; overflow-wrap: anywhere; }
  td:last-child { min-width: 0; } td.n, td.t, td:first-child { white-space: normal; }
  .plot .read, .cursor { display: none; } figure { margin-bottom: 1rem; }
  h2 { break-after: avoid; } tr { break-inside: avoid; }
  .verdict, rect, .tag, .swatch { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""

# Points at one time in all plots; values are read back from the paths themselves.
SCRIPT = """
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
  return Number(v.toPrecision(3)).toString();
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
"""
