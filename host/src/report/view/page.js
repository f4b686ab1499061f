"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const stage = document.getElementById("stage");
  const message = document.getElementById("message");
  const style = getComputedStyle(document.documentElement);
  const color = (name) => new THREE.Color(style.getPropertyValue(`--${name}`).trim());
  const decode = (text, Type) => new Type(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ antialias: true });
  } catch (error) {
    message.textContent = "This browser does not offer WebGL, so the mesh cannot be shown here. The table works all the same.";
    return;
  }
  renderer.setPixelRatio(devicePixelRatio);
  stage.prepend(renderer.domElement);
  renderer.domElement.setAttribute("aria-label", "the object and the probe's approaches, in three dimensions");
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

  // The approaches: a line for each finger's way, a ball where it touches.
  const hues = ["first", "middle", "last"].map(color);
  const gray = color("missed");
  const far = (start, direction) => -2 * start.dot(direction);
  const fingers = data.approaches.flatMap((approach, index) => approach.starts.map((from, finger) => {
    const start = new THREE.Vector3(...from), direction = new THREE.Vector3(...approach.direction);
    const distance = approach.distances[finger];
    const end = start.clone().addScaledVector(direction, distance ?? far(start, direction));
    const full = approach.distances.every((d) => d !== null);
    return { index, finger, start, end, touches: distance !== null, full };
  }));
  const ways = new THREE.LineSegments(
    new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.8 }),
  );
  ways.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(fingers.length * 6), 3));
  ways.geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(fingers.length * 6), 3));
  const ball = new THREE.SphereGeometry(data.radius, 20, 14);
  const balls = new THREE.InstancedMesh(ball, new THREE.MeshStandardMaterial({ roughness: 0.45 }), Math.max(fingers.length, 1));
  balls.count = fingers.length;
  balls.frustumCulled = ways.frustumCulled = false;
  scene.add(ways, balls);

  const shown = (id) => document.getElementById(id).checked;
  let chosen = null, hovered = null;
  const nowhere = new THREE.Matrix4().makeScale(0, 0, 0);
  const paint = () => {
    const place = ways.geometry.attributes.position, tint = ways.geometry.attributes.color;
    fingers.forEach((way, i) => {
      const alone = chosen === null ? shown(way.full ? "touches" : "misses") : way.index === chosen;
      const visible = alone || way.index === hovered;
      place.setXYZ(2 * i, ...(visible ? way.start : way.end).toArray());
      place.setXYZ(2 * i + 1, ...way.end.toArray());
      const hue = way.touches ? hues[way.finger] : gray;
      const lit = way.index === hovered || way.index === chosen ? 0 : 0.45;
      for (const k of [2 * i, 2 * i + 1]) {
        const line = hue.clone().lerp(ground, lit);
        tint.setXYZ(k, line.r, line.g, line.b);
      }
      balls.setMatrixAt(i, visible && way.touches ? new THREE.Matrix4().makeTranslation(way.end) : nowhere);
      balls.setColorAt(i, hue);
    });
    place.needsUpdate = tint.needsUpdate = balls.instanceMatrix.needsUpdate = true;
    if (balls.instanceColor) balls.instanceColor.needsUpdate = true;
    balls.computeBoundingSphere();
    for (const row of document.querySelectorAll("tbody tr")) {
      row.classList.toggle("chosen", Number(row.dataset.approach) === chosen);
      row.classList.toggle("hovered", Number(row.dataset.approach) === hovered);
    }
    frame.visible = shown("box");
    wires.visible = shown("edges");
    if (outside.flatShading === shown("smooth")) {
      outside.flatShading = !shown("smooth");
      outside.needsUpdate = true;
    }
    draw();
  };

  const render = () => {
    renderer.render(scene, camera);
    for (const { label, place } of labels) {
      const seen = place.clone().project(camera);
      label.hidden = !shown("box") || Math.abs(seen.x) > 1 || Math.abs(seen.y) > 1;
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

  const choose = (index) => {
    chosen = index === chosen ? null : index;
    if (chosen !== null) document.querySelector(`tr[data-approach="${chosen}"]`).scrollIntoView({ block: "nearest" });
    paint();
  };
  const hover = (index) => {
    if (index === hovered) return;
    hovered = index;
    paint();
  };
  for (const row of document.querySelectorAll("tbody tr")) {
    const index = Number(row.dataset.approach);
    row.addEventListener("click", () => choose(index));
    row.addEventListener("pointerenter", () => hover(index));
    row.addEventListener("pointerleave", () => hover(null));
    row.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === " ") { event.preventDefault(); choose(index); }
    });
  }
  addEventListener("keydown", (event) => { if (event.key === "Escape" && chosen !== null) choose(chosen); });
  for (const box of document.querySelectorAll("fieldset input")) box.addEventListener("change", paint);

  // Which approach's finger the pointer is on; the body hides fingers behind it.
  const ray = new THREE.Raycaster();
  const under = (event) => {
    const box = renderer.domElement.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width * 2 - 1, y = 1 - (event.clientY - box.top) / box.height * 2;
    ray.setFromCamera(new THREE.Vector2(x, y), camera);
    const hit = ray.intersectObject(balls)[0];
    return hit ? fingers[hit.instanceId].index : null;
  };
  let pressed = null;
  renderer.domElement.addEventListener("pointermove", (event) => {
    if (event.buttons === 0) hover(under(event));
  });
  renderer.domElement.addEventListener("pointerleave", () => hover(null));
  renderer.domElement.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  renderer.domElement.addEventListener("pointerup", (event) => {
    const still = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4;
    const index = still ? under(event) : null;
    if (index !== null) choose(index);
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
  paint();
  fit();
  new ResizeObserver(fit).observe(stage);
})();
