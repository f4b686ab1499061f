"use strict";
// Draws data's mesh, bounding box and lines, and calls hover and choose with the group of the line under the pointer.
// Returns show, which takes { box, edges, smooth } as booleans and lines, one { visible, lit } for each line of data;
// nothing is shown where WebGL is missing.
function drawScene(data, { hover, choose }) {
  const view = openStage();
  if (!view) return () => {};
  const { stage, canvas, scene, camera, ground, outside, color, draw } = view;
  const decode = (text, Type) => new Type(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const low = new THREE.Vector3(...data.low), high = new THREE.Vector3(...data.high);
  view.look(low, high);

  const steps = decode(data.positions, Uint16Array);
  const positions = Float32Array.from(steps, (step, i) => data.origin[i % 3] + step * data.step);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  geometry.setIndex(new THREE.BufferAttribute(decode(data.indices, data.wide ? Uint32Array : Uint16Array), 1));
  geometry.computeVertexNormals();
  const wires = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: 0x20242a, wireframe: true, transparent: true, opacity: 0.35 }));
  scene.add(view.body(geometry), wires);

  // The bounding box, with the lengths of three sides that meet.
  const size = high.clone().sub(low);
  const middle = low.clone().add(high).multiplyScalar(0.5);
  const frame = new THREE.LineSegments(
    new THREE.EdgesGeometry(new THREE.BoxGeometry(...size.toArray())),
    new THREE.LineBasicMaterial({ color: color("missed"), transparent: true, opacity: 0.6 }),
  );
  frame.position.copy(middle);
  scene.add(frame);
  const labels = [0, 1, 2].map((axis) => {
    const label = document.createElement("span");
    label.textContent = `${Number(size.getComponent(axis).toPrecision(3))} units`;
    document.getElementById("labels").append(label);
    const place = new THREE.Vector3(axis === 1 ? high.x : axis === 2 ? low.x : middle.x, low.y, low.z);
    place.setComponent(axis, middle.getComponent(axis));
    return { label, place };
  });
  view.drawn.push(() => {
    for (const { label, place } of labels) {
      const seen = place.clone().project(camera);
      label.hidden = !frame.visible || Math.abs(seen.x) > 1 || Math.abs(seen.y) > 1;
      label.style.left = `${(seen.x + 1) / 2 * stage.clientWidth}px`;
      label.style.top = `${(1 - seen.y) / 2 * stage.clientHeight}px`;
    }
  });

  // The table under the object, if there is one.
  if (data.table) {
    const side = 3 * Math.max(size.x, size.y);
    const table = new THREE.Mesh(
      new THREE.BoxGeometry(side, side, 0.01 * side),
      new THREE.MeshBasicMaterial({ color: color("missed"), transparent: true, opacity: 0.25 }),
    );
    table.position.set(middle.x, middle.y, low.z - 0.006 * side);
    scene.add(table);
  }

  // A line's color is dimmed toward the ground unless it is lit.
  const vector = (place) => new THREE.Vector3(...place);
  const lines = data.lines.map((line) => ({ ...line, start: vector(line.start), end: vector(line.end), hue: color(line.color) }));
  const paths = new THREE.LineSegments(
    new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.8 }),
  );
  paths.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(lines.length * 6), 3));
  paths.geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(lines.length * 6), 3));
  const ball = new THREE.SphereGeometry(data.radius, 20, 14);
  const balls = new THREE.InstancedMesh(ball, new THREE.MeshStandardMaterial({ roughness: 0.45 }), Math.max(lines.length, 1));
  balls.count = lines.length;
  balls.frustumCulled = paths.frustumCulled = false;
  scene.add(paths, balls);

  const nowhere = new THREE.Matrix4().makeScale(0, 0, 0);
  const show = ({ box, edges, smooth, lines: states }) => {
    const place = paths.geometry.attributes.position, tint = paths.geometry.attributes.color;
    lines.forEach((line, i) => {
      const { visible, lit } = states[i];
      place.setXYZ(2 * i, ...(visible ? line.start : line.end).toArray());
      place.setXYZ(2 * i + 1, ...line.end.toArray());
      const shade = line.hue.clone().lerp(ground, lit ? 0 : 0.45);
      for (const k of [2 * i, 2 * i + 1]) tint.setXYZ(k, shade.r, shade.g, shade.b);
      balls.setMatrixAt(i, visible && line.ball ? new THREE.Matrix4().makeTranslation(line.end) : nowhere);
      balls.setColorAt(i, line.hue);
    });
    place.needsUpdate = tint.needsUpdate = balls.instanceMatrix.needsUpdate = true;
    if (balls.instanceColor) balls.instanceColor.needsUpdate = true;
    balls.computeBoundingSphere();
    frame.visible = box;
    wires.visible = edges;
    if (outside.flatShading === smooth) {
      outside.flatShading = !smooth;
      outside.needsUpdate = true;
    }
    draw();
  };

  // Whose ball the pointer is on; the mesh hides nothing, so that every ball can be chosen.
  const group = (ray) => {
    const hit = ray.intersectObject(balls)[0];
    return hit ? lines[hit.instanceId].group : null;
  };
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons === 0) hover(group(view.under(event)));
  });
  canvas.addEventListener("pointerleave", () => hover(null));
  view.onClick((ray) => {
    const chosen = group(ray);
    if (chosen !== null) choose(chosen);
  });
  view.open();
  return show;
}
