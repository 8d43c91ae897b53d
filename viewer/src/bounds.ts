import type { Point2 } from "./flight_data";

/** The least and the greatest north and east of some places. */
export function bounds(places: Point2[]): [Point2, Point2] {
  const [north, east] = [0, 1].map((axis) => places.map((place) => place[axis]));
  return [
    [Math.min(...north), Math.min(...east)],
    [Math.max(...north), Math.max(...east)],
  ];
}
