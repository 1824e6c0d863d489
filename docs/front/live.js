/*
SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
SPDX-License-Identifier: Apache-2.0
*/
// The live example of the first page. All formulas are in arms.js, which `derive --code js` writes;
// this file draws them.
'use strict';

const LIVE_ARMS = {
  planar_2r: {
    title: 'planar 2R, seen from above',
    formulas: planar_2r,
    joints: ['q1', 'q2'],
    lengths: [1, 1],
    start: [30, 60],
    factors: ['elbow = sin(q2)'],
    // The zeros of the only factor are q2 = k pi.
    distance: ([, q2]) => Math.abs(q2 - Math.PI * Math.round(q2 / Math.PI)),
    points([q1], [l1]) {
      return [[0, 0], [l1 * Math.cos(q1), l1 * Math.sin(q1)]];
    },
    tip: (T) => [T[0][3], T[1][3]],
    reach: 2,
  },
  craig_3r: {
    title: "Craig's 3R, in the vertical plane that joint 1 turns",
    formulas: craig_3r,
    joints: ['q1', 'q2', 'q3'],
    lengths: [0.12, 0.4, 0.3],
    start: [20, -40, 70],
    factors: ['shoulder = L1 + L2 cos(q2) + L3 cos(q2 + q3)', 'elbow = sin(q3)'],
    points([, q2], [l1, l2]) {
      return [[0, 0], [l1, 0], [l1 + l2 * Math.cos(q2), -l2 * Math.sin(q2)]];
    },
    tip: (T, [q1]) => [T[0][3] * Math.cos(q1) + T[1][3] * Math.sin(q1), T[2][3]],
    reach: 0.82,
  },
};

/** Return all numbers of an arm at joint positions in rad. */
function liveNumbers(name, q) {
  const arm = LIVE_ARMS[name];
  const numbers = {};
  for (const [key, formula] of Object.entries(arm.formulas)) {
    numbers[key] = formula(q, ...arm.lengths);
  }
  if (arm.distance) numbers.distance = arm.distance(q);
  return numbers;
}

function liveTable(matrix, rows) {
  const text = (x) => (Math.abs(x) < 5e-7 ? '0' : x.toFixed(4));
  const cells = (row) => row.map((x) => `<td>${text(x)}</td>`).join('');
  const head = (k) => (rows ? `<th>${rows[k]}</th>` : '');
  return `<table>${matrix.map((row, k) => `<tr>${head(k)}${cells(row)}</tr>`).join('')}</table>`;
}

function liveDraw(place, name, q) {
  const arm = LIVE_ARMS[name];
  const numbers = liveNumbers(name, q);
  const tip = arm.tip(numbers.pose, q);
  const scale = 100 / arm.reach;
  const points = [...arm.points(q, arm.lengths), tip].map(([x, y]) => [x * scale, -y * scale]);
  const near = arm.distance ? numbers.distance < 0.1 : numbers.factors.some((f) => Math.abs(f) < 0.05);
  const dots = points.slice(0, -1).map(([x, y]) => `<circle cx="${x}" cy="${y}" r="4"/>`).join('');
  place.querySelector('svg').innerHTML =
    `<circle r="100" class="reach"/><polyline points="${points.join(' ')}"/>${dots}`;
  place.classList.toggle('near', near);
  const factors = numbers.factors.map((f, k) => `${arm.factors[k]} = ${f.toFixed(4)}`);
  const distance = arm.distance ? `<br>distance to a singular pose: ${numbers.distance.toFixed(4)} rad` : '';
  const verdict = near ? '<b>near a singular pose</b>' : 'far from singular poses';
  place.querySelector('.numbers').innerHTML =
    `<div><b>T</b>${liveTable(numbers.pose)}</div>` +
    `<div><b>J</b>${liveTable(numbers.jacobian, ['vx', 'vy', 'vz', 'wx', 'wy', 'wz'])}</div>` +
    `<p>det J = <span class="det">${numbers.determinant.toFixed(6)}</span><br>` +
    `${factors.join('<br>')}${distance}<br>${verdict}</p>`;
}

function liveChoose(place, name) {
  const arm = LIVE_ARMS[name];
  const sliders = place.querySelector('.sliders');
  sliders.innerHTML = arm.joints
    .map((joint, k) => `<label>${joint} <input type="range" min="-180" max="180" step="0.5"
      value="${arm.start[k]}" aria-label="${joint} in degrees"> <output></output></label>`)
    .join('');
  const inputs = [...sliders.querySelectorAll('input')];
  const update = () => {
    inputs.forEach((input) => { input.nextElementSibling.textContent = `${input.value}°`; });
    liveDraw(place, name, inputs.map((input) => input.value * Math.PI / 180));
  };
  inputs.forEach((input) => input.addEventListener('input', update));
  update();
}

function liveStart(place) {
  const options = Object.entries(LIVE_ARMS).map(([name, arm]) => `<option value="${name}">${arm.title}</option>`);
  place.innerHTML = `<p><select aria-label="arm">${options.join('')}</select></p>
    <div class="arm"><svg viewBox="-110 -110 220 220"></svg><div class="sliders"></div></div>
    <div class="numbers"></div>`;
  const select = place.querySelector('select');
  select.addEventListener('change', () => liveChoose(place, select.value));
  liveChoose(place, select.value);
}

if (typeof document !== 'undefined') {
  document.addEventListener('DOMContentLoaded', () => {
    document.querySelectorAll('.live-arm').forEach(liveStart);
  });
}
