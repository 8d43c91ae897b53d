// How far a UAS can still fly in each direction and come home: the charge that is left after the
// straight flight there is what the way home from there takes, with margin.

import type { Point3, ReachData } from "./flight_data";

const DIRECTIONS = 72;

/** Corners of the area, at the height of the grid; none, where it can go nowhere. */
export function reachable(reach: ReachData, i: number, from: Point3, soc: number): Point3[] {
  const [, northStep] = reach.north;
  const [, eastStep] = reach.east;
  const step = 0.25 * Math.min(northStep, eastStep);
  const left = (north: number, east: number, way: number) => {
    const needed = neededAt(reach, i, north, east);
    return needed === null ? null : soc - reach.fixed[i] - way * reach.per_m[i] - needed;
  };
  const here = left(from[0], from[1], 0);
  if (here === null || here <= 0) return [];
  return Array.from({ length: DIRECTIONS }, (_, n) => {
    const angle = (2 * Math.PI * n) / DIRECTIONS;
    const [north, east] = [Math.cos(angle), Math.sin(angle)];
    let [way, before] = [0, here];
    for (;;) {
      const next = way + step;
      const at = (far: number) => left(from[0] + far * north, from[1] + far * east, far);
      const after = at(next);
      if (after === null) {
        // beyond the fence nothing is reached: halve the step up to it
        for (let part = step / 2; part > step / 64; part /= 2) if (at(way + part) !== null) way += part;
        break;
      }
      if (after <= 0) {
        way += (step * before) / (before - after);
        break;
      }
      [way, before] = [next, after];
    }
    return [from[0] + way * north, from[1] + way * east, -reach.height] as Point3;
  });
}

/** Charge needed at a place, between the four points of the grid around it; null: outside. */
function neededAt({ north, east, needed }: ReachData, i: number, x: number, y: number): number | null {
  const [row, column] = [(x - north[0]) / north[1], (y - east[0]) / east[1]];
  const [rows, columns] = [north[2], east[2]];
  if (row < 0 || column < 0 || row > rows - 1 || column > columns - 1) return null;
  const [r, c] = [Math.min(rows - 2, Math.floor(row)), Math.min(columns - 2, Math.floor(column))];
  const at = (dr: number, dc: number) =>
    needed.values[(i * rows + r + dr) * columns + c + dc] * needed.unit;
  const [u, v] = [row - r, column - c];
  return (
    (1 - u) * ((1 - v) * at(0, 0) + v * at(0, 1)) + u * ((1 - v) * at(1, 0) + v * at(1, 1))
  );
}
