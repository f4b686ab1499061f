"use strict";
// Draws data's mesh, bounding box and lines, and calls hover and choose with the group of the line under the pointer.
// Returns show, which takes { box, edges, smooth } as booleans and lines, one { visible, lit } for each line of data;
// nothing where WebGL is missing.
function drawScene(data, { hover, choose }) {
  const stage = document.getElementById("stage");
  const message = document.getElementById("message");
  const style = getComputedStyle(document.documentElement);
  const color = (name) => new THREE.Color(style.getPropertyValue(`--${name}`).trim());
  const decode = (text, Type) => new Type(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true });
  } catch (error) {
    message.textContent = "This browser does not offer WebGL, so the mesh cannot be shown here.";
    return () => {};
  }
  renderer.setPixelRatio(devicePixelRatio);
  stage.prepend(renderer.domElement);
  renderer.domElement.setAttribute("role", "img");
  renderer.domElement.setAttribute("aria-label", document.querySelector("#scene figcaption").textContent);
  const ground = color("ground");
  const scene = new THREE.Scene();
  scene.background = ground;
  const low = new THREE.Vector3(...data.low), high = new THREE.Vector3(...data.high);
  const reach = high.clone().sub(low).length() / 2;
  const camera = new THREE.PerspectiveCamera(35, 1, reach / 50, reach * 50);
  camera.up.set(0, 0, 1);
  // The flatter it lies, the more from above.
  const flatness = Math.min(1, (high.z - low.z) / Math.min(high.x - low.x, high.y - low.y));
  camera.position.set(0.55, -0.95, 2 - 1.5 * flatness).normalize().multiplyScalar(reach * 4.2);
  scene.add(camera, new THREE.HemisphereLight(0xffffff, 0x8890a0, 1.6));
  const lamp = new THREE.DirectionalLight(0xffffff, 2.2);
  lamp.position.set(-1, 1.2, 1);
  camera.add(lamp);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);

  // The mesh: outside in gray, inside in the warning color.
  const steps = decode(data.positions, Uint16Array);
  const positions = Float32Array.from(steps, (step, i) => data.origin[i % 3] + step * data.step);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  geometry.setIndex(new THREE.BufferAttribute(decode(data.indices, data.wide ? Uint32Array : Uint16Array), 1));
  geometry.computeVertexNormals();
  const outside = new THREE.MeshStandardMaterial({ color: 0xb9c0c9, roughness: 0.6, side: THREE.FrontSide });
  const inside = new THREE.MeshBasicMaterial({ color: color("back"), side: THREE.BackSide });
  // A little back, so that edges show on it; the inside a little further, so that it does not shine through a rim.
  outside.polygonOffset = inside.polygonOffset = true;
  outside.polygonOffsetFactor = outside.polygonOffsetUnits = 1;
  inside.polygonOffsetFactor = inside.polygonOffsetUnits = 3;
  const body = new THREE.Mesh(geometry, outside);
  scene.add(body, new THREE.Mesh(geometry, inside));
  const wires = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: 0x20242a, wireframe: true, transparent: true, opacity: 0.35 }));
  scene.add(wires);

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

  const render = () => {
    renderer.render(scene, camera);
    for (const { label, place } of labels) {
      const seen = place.clone().project(camera);
      label.hidden = !frame.visible || Math.abs(seen.x) > 1 || Math.abs(seen.y) > 1;
      label.style.left = `${(seen.x + 1) / 2 * stage.clientWidth}px`;
      label.style.top = `${(1 - seen.y) / 2 * stage.clientHeight}px`;
    }
  };
  // Nothing moves by itself, so a frame is drawn only when something changed.
  let waiting = false;
  const draw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      render();
    });
  };
  controls.addEventListener("change", draw);

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
  const ray = new THREE.Raycaster();
  const under = (event) => {
    const box = renderer.domElement.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width * 2 - 1, y = 1 - (event.clientY - box.top) / box.height * 2;
    ray.setFromCamera(new THREE.Vector2(x, y), camera);
    const hit = ray.intersectObject(balls)[0];
    return hit ? lines[hit.instanceId].group : null;
  };
  let pressed = null;
  renderer.domElement.addEventListener("pointermove", (event) => {
    if (event.buttons === 0) hover(under(event));
  });
  renderer.domElement.addEventListener("pointerleave", () => hover(null));
  renderer.domElement.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  renderer.domElement.addEventListener("pointerup", (event) => {
    const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
    const group = still ? under(event) : null;
    if (group !== null) choose(group);
  });

  const fit = () => {
    const { clientWidth: width, clientHeight: height } = stage;
    const now = renderer.getSize(new THREE.Vector2());
    if (width === 0 || height === 0 || (now.x === width && now.y === height)) return;
    renderer.setSize(width, height);
    camera.aspect = width / height;
    // What fits a narrow window's width fits its height.
    camera.fov = width < height ? 2 * Math.atan(Math.tan(17.5 * Math.PI / 180) / camera.aspect) * 180 / Math.PI : 35;
    camera.updateProjectionMatrix();
    // At once: the new size has cleared the drawing.
    render();
  };
  fit();
  new ResizeObserver(fit).observe(stage);
  return show;
}
