for (const svg of document.querySelectorAll('svg.turned')) {
  const {scale, center} = svg.dataset, [cx, cy, cz] = center.split(' ').map(Number);
  const [, , width, height] = svg.getAttribute('viewBox').split(' ').map(Number);
  const lines = [...svg.querySelectorAll('line[data-p]')]
    .map(line => [line, line.dataset.p.split(' ').map(Number)]);
  let turn = +svg.dataset.turn, lift = +svg.dataset.lift, from = null;
  function at(x, y, z) {
    [x, y, z] = [x - cx, y - cy, z - cz];
    const [s, c, u, v] = [Math.sin(turn), Math.cos(turn), Math.sin(lift), Math.cos(lift)];
    return [width / 2 + scale * (c * y - s * x), height / 2 - scale * (v * z - u * (c * x + s * y))];
  }
  function draw() {
    for (const [line, p] of lines) {
      const [x1, y1] = at(p[0], p[1], p[2]), [x2, y2] = at(p[3], p[4], p[5]);
      line.setAttribute('x1', x1); line.setAttribute('y1', y1);
      line.setAttribute('x2', x2); line.setAttribute('y2', y2);
    }
  }
  svg.addEventListener('pointerdown', e => {
    from = [e.clientX, e.clientY]; svg.setPointerCapture(e.pointerId);
  });
  svg.addEventListener('pointermove', e => {
    if (from === null) return;
    turn -= (e.clientX - from[0]) / 150;
    lift = Math.max(-1.5, Math.min(1.5, lift + (e.clientY - from[1]) / 150));
    from = [e.clientX, e.clientY];
    draw();
  });
  for (const end of ['pointerup', 'pointercancel']) svg.addEventListener(end, () => { from = null; });
}
