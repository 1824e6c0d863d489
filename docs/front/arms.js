/*
SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
SPDX-License-Identifier: Apache-2.0
*/
// Made by docs/from_code.py.
const planar_2r = (() => {
// planar_2r: kinematics, derived from its robot file.
// Joints: q1, q2 (rad, m).
// Lengths of the file: L1 = 1.0 m, L2 = 1.0 m.
// Jacobian: rows vx vy vz wx wy wz of the tool in base axes.
// Task rows of the determinant: x y.

function pose(q, L1, L2) {
  const [q1, q2] = q;
  const x_0 = q1 + q2;
  const x_1 = Math.cos(x_0);
  const x_2 = Math.sin(x_0);
  return [
    [x_1, -x_2, 0, L1*Math.cos(q1) + L2*x_1],
    [x_2, x_1, 0, L1*Math.sin(q1) + L2*x_2],
    [0, 0, 1, 0],
    [0, 0, 0, 1],
  ];
}

function jacobian(q, L1, L2) {
  const [q1, q2] = q;
  const x_0 = q1 + q2;
  const x_1 = L2*Math.sin(x_0);
  const x_2 = L2*Math.cos(x_0);
  return [
    [-L1*Math.sin(q1) - x_1, -x_1],
    [L1*Math.cos(q1) + x_2, x_2],
    [0, 0],
    [0, 0],
    [0, 0],
    [1, 1],
  ];
}

function determinant(q, L1, L2) {
  const [q1, q2] = q;
  return L1*L2*Math.sin(q2);
}

function factors(q, L1, L2) {
  const [q1, q2] = q;
  return [
    Math.sin(q2),
  ];
}

return { pose, jacobian, determinant, factors };
})();

const craig_3r = (() => {
// craig_3r: kinematics, derived from its robot file.
// Joints: q1, q2, q3 (rad, m).
// Lengths of the file: L1 = 0.12 m, L2 = 0.4 m, L3 = 0.3 m.
// Jacobian: rows vx vy vz wx wy wz of the tool in base axes.
// Task rows of the determinant: x y z.

function pose(q, L1, L2, L3) {
  const [q1, q2, q3] = q;
  const x_0 = Math.cos(q1);
  const x_1 = q2 + q3;
  const x_2 = Math.cos(x_1);
  const x_3 = Math.sin(x_1);
  const x_4 = Math.sin(q1);
  const x_5 = L1 + L2*Math.cos(q2) + L3*x_2;
  return [
    [x_0*x_2, -x_0*x_3, -x_4, x_0*x_5],
    [x_2*x_4, -x_3*x_4, x_0, x_4*x_5],
    [-x_3, -x_2, 0, -L2*Math.sin(q2) - L3*x_3],
    [0, 0, 0, 1],
  ];
}

function jacobian(q, L1, L2, L3) {
  const [q1, q2, q3] = q;
  const x_0 = Math.sin(q1);
  const x_1 = q2 + q3;
  const x_2 = L3*Math.cos(x_1);
  const x_3 = L2*Math.cos(q2) + x_2;
  const x_4 = L1 + x_3;
  const x_5 = Math.cos(q1);
  const x_6 = L3*Math.sin(x_1);
  const x_7 = L2*Math.sin(q2) + x_6;
  const x_8 = -x_0;
  return [
    [-x_0*x_4, -x_5*x_7, -x_5*x_6],
    [x_4*x_5, -x_0*x_7, -x_0*x_6],
    [0, -x_3, -x_2],
    [0, x_8, x_8],
    [0, x_5, x_5],
    [1, 0, 0],
  ];
}

function determinant(q, L1, L2, L3) {
  const [q1, q2, q3] = q;
  return L2*L3*(L1 + L2*Math.cos(q2) + L3*Math.cos(q2 + q3))*Math.sin(q3);
}

function factors(q, L1, L2, L3) {
  const [q1, q2, q3] = q;
  return [
    L1 + L2*Math.cos(q2) + L3*Math.cos(q2 + q3),
    Math.sin(q3),
  ];
}

return { pose, jacobian, determinant, factors };
})();
