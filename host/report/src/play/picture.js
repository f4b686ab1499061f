"use strict";
// The picture of a game: the object, the probe's three fingers, and where they made contact. Calls touch with a point and
// a direction where the surface is clicked. Without WebGL all of it does nothing.
function openPicture(data, touch) {
  const view = openStage();
  if (!view) return { show() {}, clear() {}, approach() {}, propose() {} };
  const { scene, color, draw } = view;
  const { radius, spacing, stroke, travel } = data.probe;
  const vector = (numbers) => new THREE.Vector3(...numbers);
  const hues = ["first", "middle", "last"].map(color);

  // The probe: three balls, moved along their lines.
  const ball = new THREE.SphereGeometry(radius, 24, 16);
  const material = (hue) => new THREE.MeshStandardMaterial({ color: hue, roughness: 0.45, transparent: true });
  const fingers = hues.map((hue) => new THREE.Mesh(ball, material(hue)));
  const missed = color("missed");
  const probe = new THREE.Group();
  probe.add(...fingers);
  probe.visible = false;
  // Lines of three fingers: of the last approach, and of the proposed one.
  const lines = (opacity, tints) => {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(18), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(Float32Array.from(tints.flatMap((tint) => [...tint.toArray(), ...tint.toArray()])), 3));
    const drawn = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity }));
    drawn.frustumCulled = drawn.visible = false;
    return drawn;
  };
  const stretch = (drawn, ends) => {
    const place = drawn.geometry.attributes.position;
    ends.flat().forEach((end, i) => place.setXYZ(i, end.x, end.y, end.z));
    place.needsUpdate = drawn.visible = true;
  };
  const ways = lines(0.55, hues);
  const plan = lines(0.9, [0, 1, 2].map(() => color("plan")));
  const heads = [0, 1, 2].map(() => new THREE.Mesh(ball, new THREE.MeshBasicMaterial({ color: color("plan") })));
  const planned = new THREE.Group();
  planned.add(plan, ...heads);
  planned.visible = false;

  // Contacts, the newest of them over the oldest.
  const MOST = 3000;
  const marks = new THREE.InstancedMesh(new THREE.SphereGeometry(0.7 * radius, 12, 8), new THREE.MeshStandardMaterial({ roughness: 0.6 }), MOST);
  marks.count = 0;
  marks.frustumCulled = false;
  let made = 0;
  const mark = (place, finger) => {
    const at = made % MOST;
    marks.setMatrixAt(at, new THREE.Matrix4().makeTranslation(place));
    marks.setColorAt(at, hues[finger]);
    made += 1;
    marks.count = Math.min(made, MOST);
    marks.instanceMatrix.needsUpdate = true;
    if (marks.instanceColor) marks.instanceColor.needsUpdate = true;
  };
  scene.add(probe, ways, planned, marks);

  let body = null;
  let box = { low: new THREE.Vector3(-1, -1, -1), high: new THREE.Vector3(1, 1, 1) };
  // Shows an object, or if it is hidden only how it is looked at: from where every object is.
  const show = (vertices, triangles, hidden) => {
    if (body) scene.remove(body);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(vertices, 3));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    geometry.computeVertexNormals();
    const bounds = new THREE.Box3().setFromBufferAttribute(geometry.attributes.position);
    box = { low: bounds.min, high: bounds.max };
    const reach = bounds.max.clone().sub(bounds.min).length() / 2;
    view.outside.flatShading = triangles.length <= 15000;
    view.outside.needsUpdate = true;
    body = view.body(geometry);
    body.visible = !hidden;
    scene.add(body);
    // A hidden one is looked at as if it were a cube.
    const corner = new THREE.Vector3(reach, reach, reach).multiplyScalar(0.6);
    view.look(...(hidden ? [corner.clone().negate(), corner] : [box.low, box.high]), 3.6);
    draw();
  };
  const reveal = () => {
    if (body) body.visible = true;
    draw();
  };
  const clear = () => {
    made = marks.count = 0;
    probe.visible = ways.visible = false;
    motion = null;
    draw();
  };

  // Where each finger starts and ends: one that misses goes on beyond the object, as far as the hand does.
  const paths = ({ start, direction, alignment, distances, most = Infinity }) => [-1, 0, 1].map((place, finger) => {
    const from = vector(start).addScaledVector(vector(alignment), place * spacing);
    const contacts = distances.filter((distance) => distance !== null);
    const end = contacts.length ? Math.min(...contacts) + (stroke ?? Infinity) : (travel ?? Infinity);
    const way = distances[finger] ?? Math.min(-2 * from.dot(vector(direction)), end, most);
    return [from, from.clone().addScaledVector(vector(direction), way)];
  });
  // Moves the fingers to their contacts, all at the same speed, within 0.6 s; at once where that is asked for.
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  let motion = null;
  const arrive = ({ ends, contacts }) => {
    ends.forEach(([, end], finger) => fingers[finger].position.copy(end));
    // A finger that missed is gray and pale, so that it is not taken for a contact.
    fingers.forEach((finger, index) => {
      finger.material.color.copy(contacts[index] ? hues[index] : missed);
      finger.material.opacity = contacts[index] ? 1 : 0.4;
    });
    ends.forEach(([, end], finger) => contacts[finger] && mark(end, finger));
    motion = null;
  };
  const step = (now) => {
    if (!motion) return;
    const share = Math.min(1, (now - motion.began) / 600);
    const longest = Math.max(...motion.ends.map(([from, to]) => from.distanceTo(to)));
    motion.ends.forEach(([from, to], finger) => {
      const length = from.distanceTo(to);
      fingers[finger].position.lerpVectors(from, to, Math.min(1, share * longest / Math.max(length, 1e-9)));
    });
    if (share === 1) arrive(motion);
    else requestAnimationFrame(step);
    draw();
  };
  const approach = (approached, atOnce) => {
    if (motion) arrive(motion);
    const ends = paths(approached);
    motion = { ends, contacts: approached.distances.map((distance) => distance !== null), began: performance.now() };
    fingers.forEach((finger, index) => {
      finger.material.color.copy(hues[index]);
      finger.material.opacity = 1;
    });
    probe.visible = true;
    stretch(ways, ends);
    if (atOnce || still.matches) {
      arrive(motion);
      draw();
    } else {
      requestAnimationFrame(step);
    }
  };
  // The approach that a plan proposes: three lines toward the middle of the object, or down to the table, with the fingers where
  // they start.
  const propose = (proposal) => {
    planned.visible = Boolean(proposal);
    if (proposal) {
      const reach = proposal.reach ?? 0.9 * box.high.clone().sub(box.low).length() / 2 + spacing;
      const middle = vector(proposal.at ?? [0, 0, 0]);
      const ends = [-1, 0, 1].map((place) => {
        const aside = vector(proposal.alignment).multiplyScalar(place * spacing);
        return [1, proposal.at ? 0 : 0.55].map((far) => vector(proposal.direction).multiplyScalar(-far * reach).add(aside).add(middle));
      });
      stretch(plan, ends);
      ends.forEach(([from], finger) => heads[finger].position.copy(from));
    }
    draw();
  };

  view.onClick(({ ray }) => touch(ray.origin.toArray(), ray.direction.toArray()));
  view.open();
  return { view, show, reveal, clear, approach, propose };
}
