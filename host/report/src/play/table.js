"use strict";
// The page of a table: the hand comes down where one clicks or where it tells most, and the belief is shown as ghosts.
(() => {
  const { data, game } = openPage();
  if (!game) return;
  const { exports, put, bytes, taken, sure, number } = game;
  const element = (id) => document.getElementById(id);
  const random = (below) => Math.floor(Math.random() * below);
  const one = (length) => length.toFixed(1).replace(/^-0\.0$/, "0.0").replace("-", "\u2212");
  const degrees = (turn) => (Number.isNaN(turn) ? "any" : `${Math.round(turn * 180 / Math.PI + 360) % 360}`);

  // How objects may lie: the surface of each placement, drawn when it is first needed.
  const { radius, spacing } = data.probe;
  const lying = data.objects.map(({ placements }, object) => placements.map(({ name, weight, rotation }) => {
    const own = number(object);
    put(new Uint8Array(Float64Array.from(rotation).buffer), new TextEncoder().encode(name));
    return { name, vertices: Float32Array.from(taken(sure(exports.lay(own, weight), name))) };
  }));
  put(bytes(data.maps));
  sure(exports.open_maps(...data.real), "the maps");
  const TOP = 10 + Math.max(...lying.flat().map(({ vertices }) => vertices.reduce((top, z, i) => (i % 3 === 2 ? Math.max(top, z) : top), 0)));

  const picture = openPicture(data, (origin, direction) => {
    if (direction[2] >= 0) return;
    const way = -origin[2] / direction[2];
    aim([0, 1].map((axis) => origin[axis] + way * direction[axis]), roll);
    press();
  });
  const { view } = picture;
  if (view) {
    const vector = (x, y, z) => new THREE.Vector3(x, y, z);
    view.look(vector(-data.reach, -data.reach, 0), vector(data.reach, data.reach, TOP), 3.7);
    const board = new THREE.Mesh(new THREE.BoxGeometry(3 * data.reach, 3 * data.reach, 1),
      new THREE.MeshBasicMaterial({ color: view.color("missed"), transparent: true, opacity: 0.25 }));
    board.position.z = -0.6;
    const grid = new THREE.BufferGeometry(), ends = [];
    for (let at = -data.reach; at <= data.reach; at += data.reach / 3) {
      ends.push(at, -data.reach, 0, at, data.reach, 0, -data.reach, at, 0, data.reach, at, 0);
    }
    grid.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(ends), 3));
    view.scene.add(board, new THREE.LineSegments(grid, new THREE.LineBasicMaterial({ color: view.color("missed"), transparent: true, opacity: 0.4 })));
    view.canvas.addEventListener("keydown", ({ key }) => {
      if (key === "r" || key === "R") aim(place, roll + 15);
    });
  }
  const shape = (object, placement) => {
    const own = lying[object][placement];
    if (!own.geometry) {
      own.geometry = new THREE.BufferGeometry();
      own.geometry.setAttribute("position", new THREE.BufferAttribute(own.vertices, 3));
      own.geometry.setIndex(new THREE.BufferAttribute(game.triangles(object), 1));
      own.geometry.computeVertexNormals();
    }
    return own.geometry;
  };
  const lay = (drawn, { x, y, yaw }) => {
    drawn.position.set(x, y, 0);
    drawn.rotation.z = yaw || 0;
    view.scene.add(drawn);
    return drawn;
  };
  let drawn = [], truth = null;
  const clear = () => {
    drawn.forEach((ghost) => {
      view.scene.remove(ghost);
      ghost.material?.dispose();
    });
    drawn = [];
  };
  const haunt = ({ leader, ghosts }) => {
    if (!view) return;
    clear();
    drawn = ghosts.map((ghost) => lay(new THREE.Mesh(shape(ghost.object, ghost.placement), new THREE.MeshStandardMaterial({
      color: view.color(ghost.object === leader ? "first" : "last"), roughness: 0.6, transparent: true, depthWrite: false,
      opacity: 0.05 + 0.55 * Math.sqrt(ghost.share),
    })), ghost));
    if (truth) drawn.push(lay(view.body(shape(truth.object, truth.placement)), truth));
    view.draw();
  };

  const believed = () => {
    const count = sure(exports.belief(), "the belief"), objects = data.objects.length;
    const [verdict, leader, touches, ...rest] = taken(3 + objects + 9 * count);
    // The locator rounds each by itself: together they are everything.
    const sum = rest.slice(0, objects).reduce((sum, posterior) => sum + posterior) || 1;
    const ghost = (_, index) => {
      const [object, placement, x, y, yaw, share, ...within] = rest.slice(objects + 9 * index);
      return { object, placement, x, y, yaw, share, within };
    };
    return {
      verdict: ["undecided", "recognized", "unknown", "gave up"][verdict], leader, touches,
      posteriors: rest.slice(0, objects).map((posterior) => posterior / sum), ghosts: Array.from({ length: count }, ghost),
    };
  };
  const bars = openBars(data.objects.map(({ name }) => name));
  const named = ({ object, placement }) => `${data.objects[object].name}, ${lying[object][placement].name}`;
  const at = ({ x, y, yaw }) => `x ${one(x)} mm, y ${one(y)} mm, yaw ${degrees(yaw)}${Number.isNaN(yaw) ? "" : "°"}`;
  const update = () => {
    const belief = believed();
    const { verdict, leader, touches, posteriors, ghosts } = belief;
    bars(posteriors, posteriors.map(() => data.threshold), touches > 0 ? leader : null, verdict === "recognized");
    const name = data.objects[leader].name, count = `${touches} approach${touches === 1 ? "" : "es"}`;
    const best = ghosts.find(({ object }) => object === leader);
    const [x, y, yaw] = best?.within ?? [];
    const pose = best ? ` It lies on the table as ${lying[leader][best.placement].name}: x ${one(best.x)} ± ${one(x)} mm, y ${one(best.y)} ± ${one(y)} mm, yaw `
      + `${Number.isNaN(yaw) ? "any" : `${degrees(best.yaw)} ± ${Math.ceil(yaw * 180 / Math.PI)}°`}.` : "";
    element("verdict").textContent = {
      undecided: touches === 0 ? "Undecided: nothing is known yet. Press the blue button." : posteriors[leader] > data.threshold
        ? `Undecided after ${count}: ${name} is almost certain, but where it lies is not found yet. Press again.`
        : `Undecided after ${count}: ${name} leads with ${percent(posteriors[leader])} %.`,
      recognized: `Recognized: ${name}, after ${count}.${pose}`,
      unknown: `It is no object that the maps know, after ${count}.`,
      "gave up": `The locator gave up after ${count}.`,
    }[verdict];
    element("verdict").dataset.verdict = verdict;
    element("ghosts").tBodies[0].replaceChildren(...ghosts.map((ghost) => {
      const { object, placement, share } = ghost;
      return rowOf([data.objects[object].name, lying[object][placement].name, one(ghost.x), one(ghost.y), degrees(ghost.yaw), percent(share)], 0, "number");
    }));
    haunt(belief);
    return verdict;
  };

  // Where the hand comes down next.
  let place = [0, 0], roll = 0;
  const aim = (to, turn) => {
    const within = (number) => Math.min(data.reach, Math.max(-data.reach, number));
    [place, roll] = [to.map(within), turn % 180];
    [...place, roll].forEach((value, index) => {
      const slider = element(["x", "y", "roll"][index]);
      slider.value = value;
      slider.parentElement.querySelector("output").textContent = `${Math.round(value)}${index === 2 ? "°" : " mm"}`;
    });
    const angle = roll * Math.PI / 180;
    picture.propose({ at: [...place, 0], reach: TOP + radius, direction: [0, 0, -1], alignment: [Math.cos(angle), Math.sin(angle), 0] });
  };
  for (const id of ["x", "y", "roll"]) {
    element(id).addEventListener("input", () => aim(["x", "y"].map((axis) => Number(element(axis).value)), Number(element("roll").value)));
  }
  let approaches = 0;
  const press = (atOnce = false) => {
    const turn = Math.round(roll / 360 * 256);
    if (exports.press(...place, turn) < 0) {
      element("answer").textContent = `No more than ${approaches} approaches fit. Reveal it, or take another object.`;
      stop();
      return;
    }
    const [...heights] = taken(4);
    const lowest = heights.pop(), angle = turn / 256 * 2 * Math.PI;
    const distances = heights.map((height) => (Number.isNaN(height) ? null : TOP - Math.max(height, 0)));
    picture.approach({
      start: [...place, TOP + radius], direction: [0, 0, -1], alignment: [Math.cos(angle), Math.sin(angle), 0], distances, most: TOP - lowest,
    }, atOnce);
    approaches += 1;
    const shown = heights.map((height) => (Number.isNaN(height) ? "–" : one(height)));
    element("touches").tBodies[0].prepend(rowOf([approaches, ...place.map(one), Math.round(roll), ...shown], 0, "number"));
    const verdict = update();
    if (truth) show();
    return verdict;
  };
  const next = (atOnce) => {
    sure(exports.choose(), "the choice");
    const [x, y, turn] = taken(3);
    aim([x, y], turn / 256 * 360);
    return press(atOnce);
  };
  const show = () => {
    sure(exports.truth(), "the truth");
    const [object, placement, x, y, yaw] = taken(5);
    truth = { object, placement, x, y, yaw };
    element("answer").textContent = `It is the ${named(truth)}: ${at(truth)}.`;
    haunt(believed());
  };
  const begin = () => {
    stop();
    [truth, approaches] = [null, 0];
    sure(exports.hide(random(data.objects.length), random(2 ** 31)), "the table");
    element("touches").tBodies[0].replaceChildren();
    element("answer").textContent = "";
    picture.clear();
    aim([0, 0], 0);
    update();
  };
  let going = null;
  const stop = () => {
    clearInterval(going);
    going = null;
    element("until").textContent = "Press until sure";
  };
  element("next").addEventListener("click", () => next());
  element("there").addEventListener("click", () => press());
  element("reveal").addEventListener("click", show);
  element("again").addEventListener("click", begin);
  element("until").addEventListener("click", () => {
    if (going !== null) return stop();
    if (element("verdict").dataset.verdict !== "undecided") begin();
    element("until").textContent = "Stop";
    going = setInterval(() => {
      if (next(true) !== "undecided") stop();
    }, 700);
  });
  begin();
})();
