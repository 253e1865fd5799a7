"use strict";
// Turns the picture of the instrument. Without this script the page shows it from one side.
(() => {
  const data = document.getElementById("scene-data");
  const scene = document.getElementById("scene");
  if (!data || !scene) return;
  const s = JSON.parse(data.textContent), svg = scene.ownerSVGElement;
  const view = { azimuth: s.azimuth, elevation: s.elevation, zoom: 1, shot: 0, larger: 1 };
  const text = (value) => String(value).replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const number = (value) => value.toFixed(1);

  const turned = ([x, y, z]) => {
    const sa = Math.sin(view.azimuth), ca = Math.cos(view.azimuth), se = Math.sin(view.elevation), ce = Math.cos(view.elevation);
    return [ca * x - sa * y, se * (sa * x + ca * y) + ce * z];
  };
  const scale = () => 0.46 * s.height / s.radius * view.zoom;
  const at = (p) => {
    const [right, up] = turned(p.map((x, i) => x - s.middle[i]));
    return [0.5 * s.width + scale() * right, 0.5 * s.height - scale() * up];
  };
  const line = (from, to) => `M${at(from).map(number).join(" ")}L${at(to).map(number).join(" ")}`;
  const axes = (origin, directions, length) => directions.map((d, k) =>
    `<path class="axis-${"xyz"[k]}" d="${line(origin, origin.map((x, i) => x + length * s.radius * d[i] / view.zoom))}"/>`).join("");

  // the outline of an ellipsoid: that of the covariance P C Pᵀ of the projection
  const ellipsoid = ({ n, p, c }) => {
    const [x, y] = at(p);
    let drawn = "";
    if (c) {
      const e = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(turned);
      let xx = 0, xy = 0, yy = 0;
      c.forEach((row, i) => row.forEach((v, j) => { xx += e[i][0] * v * e[j][0]; xy += e[i][0] * v * e[j][1]; yy += e[i][1] * v * e[j][1]; }));
      const mean = 0.5 * (xx + yy), half = Math.hypot(0.5 * (xx - yy), xy), k = s.magnified * view.larger * scale();
      const angle = -0.5 * Math.atan2(2 * xy, xx - yy) * 180 / Math.PI;
      drawn = `<ellipse class="known" rx="${number(k * Math.sqrt(Math.max(mean + half, 0)))}" ry="${number(k * Math.sqrt(Math.max(mean - half, 0)))}" transform="translate(${number(x)} ${number(y)}) rotate(${number(angle)})"><title>${text(n)}</title></ellipse>`;
    }
    return `${drawn}<circle class="point" cx="${number(x)}" cy="${number(y)}" r="1.5"/>`;
  };
  const chain = ({ n, f }) => {
    const links = f.slice(1).map((frame, k) => line(f[k].o, frame.o)).join("");
    const [x, y] = at(f[f.length - 1].o);
    return `<path class="link" d="${links}"/>${f.map((frame) => axes(frame.o, frame.a, 0.06)).join("")}<text x="${number(x + 6)}" y="${number(y + 12)}">${text(n)}</text>`;
  };
  const draw = () => {
    const shot = s.shots[view.shot];
    const parts = [axes([0, 0, 0], [[1, 0, 0], [0, 1, 0], [0, 0, 1]], 0.16)];
    if (shot) parts.push(...shot.sights.map(([a, b]) => `<path class="sight" d="${line(a, b)}"/>`), ...shot.chains.map(chain));
    parts.push(...s.shots.flatMap((one) => one.points).concat(s.points).map(ellipsoid));
    scene.innerHTML = parts.join("");
    const shown = document.getElementById("shown"), times = document.getElementById("times");
    if (shown && shot) shown.textContent = `${shot.r} of ${shot.m}`;
    if (times) times.textContent = Number((s.magnified * view.larger).toPrecision(3));
  };

  const turn = (right, down) => {
    view.azimuth += 0.008 * right;
    view.elevation = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, view.elevation + 0.008 * down));
    draw();
  };
  const nearer = (factor) => { view.zoom = Math.min(200, Math.max(0.2, view.zoom * factor)); draw(); };
  let held = null;
  svg.tabIndex = 0;
  svg.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; try { svg.setPointerCapture(e.pointerId); } catch { /* the pointer is gone */ } });
  svg.addEventListener("pointermove", (e) => { if (held) { turn(e.clientX - held[0], e.clientY - held[1]); held = [e.clientX, e.clientY]; } });
  for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = null; });
  svg.addEventListener("wheel", (e) => { e.preventDefault(); nearer(Math.exp(-0.001 * e.deltaY)); }, { passive: false });
  svg.addEventListener("keydown", (e) => {
    const keys = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] };
    if (keys[e.key]) { e.preventDefault(); turn(...keys[e.key]); }
    if (e.key === "+") nearer(1.2);
    if (e.key === "-") nearer(1 / 1.2);
  });
  document.getElementById("shot")?.addEventListener("input", (e) => { view.shot = Number(e.target.value); draw(); });
  document.getElementById("larger")?.addEventListener("input", (e) => { view.larger = 10 ** Number(e.target.value); draw(); });
  draw();
})();
