// Catchlights of the stage, placed as by tts2face.picture.catchlights: in the upper third of what is seen of each iris.

import { THREE } from "nicegui-scene";

const clamp = (value, low = 0, high = 1) => Math.min(Math.max(value, low), high);
const smooth = (value, low, high) => {
  const share = clamp((value - low) / (high - low));
  return share * share * (3 - 2 * share);
};

/** Height of a lid's edge, points [across, height] in order, at a place across; constant beyond its ends. */
function heightAt(lid, across) {
  const next = lid.findIndex(([x]) => x >= across);
  if (next === 0) return lid[0][1];
  if (next < 0) return lid[lid.length - 1][1];
  const [[x0, y0], [x1, y1]] = lid.slice(next - 1, next + 1);
  return x1 > x0 ? y0 + ((across - x0) / (x1 - x0)) * (y1 - y0) : y1;
}

/**
 * Write the axes across the line of sight, and place along them, scale and strength of an eye's catchlight. `lids`, in
 * the world from the centre of the eyeball over its radius, may be empty; `numbers` are those of the face's `stage`.
 */
export function placeCatchlight(camera, centre, gaze, lids, iris, size, numbers, { right, up, spot }) {
  const sight = centre.clone().sub(camera.position).normalize();
  right.set(1, 0, 0).transformDirection(camera.matrixWorld);
  right.addScaledVector(sight, -right.dot(sight)).normalize();
  up.crossVectors(right, sight);
  const x = iris * gaze.dot(right), y = iris * gaze.dot(up), radius = Math.sqrt(1 - iris * iris);
  const towards = -gaze.dot(sight), away = Math.max(x * x + y * y, 1e-12), narrow = 1 - Math.max(towards, 0) ** 2;
  const [wide, high] = [x, y].map((of) => radius * Math.sqrt(1 - (narrow * of * of) / away));
  const edges = lids.map((lid) => lid.map((place) => [place.dot(right), place.dot(up)]).sort((a, b) => a[0] - b[0]));
  const ends = edges.flat().map(([across]) => across);
  const left = Math.max(x - wide, ends.length ? Math.min(...ends) : -Infinity);
  const end = Math.min(x + wide, ends.length ? Math.max(...ends) : Infinity);
  const across = (left + end) / 2 + (numbers.aside * Math.max(end - left, 0)) / 2;
  const half = high * Math.sqrt(Math.max(1 - ((across - x) / Math.max(wide, 1e-6)) ** 2, 0));
  const low = Math.max(y - half, edges.length ? heightAt(edges[1], across) : -Infinity);
  const seen = Math.max(Math.min(y + half, edges.length ? heightAt(edges[0], across) : Infinity) - low, 0);
  const whole = size * radius * smooth(seen / radius, ...numbers.grows);
  const strength = smooth(seen / radius, ...numbers.appears) * smooth(towards, ...numbers.turns);
  spot.set(across, low + numbers.height * seen, 1 / Math.max(Math.min(whole, numbers.most * seen), 1e-3), strength);
}
