// From the flight's frame (north, east, down) to the scene's (x east, y up, z south).

import { BufferGeometry, Float32BufferAttribute, Vector3 } from "three";
import type { Body, Point3 } from "./flight_data";

export function place(point: Point3): Vector3 {
  return new Vector3(point[1], -point[2], -point[0]);
}

export function bodyGeometry(body: Body): BufferGeometry {
  const values: number[] = [];
  for (const triangle of body.triangles) {
    for (const corner of triangle) values.push(...place(body.corners[corner]).toArray());
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(values, 3));
  // the triangles share no corners, so that every face is flat
  geometry.computeVertexNormals();
  return geometry;
}
