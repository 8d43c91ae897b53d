// Obstacles that move, in 3D.

import {
  CylinderGeometry,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshLambertMaterial,
} from "three";
import type { Flight, Moment } from "./flight";
import { colour } from "./palette";
import { place } from "./scene_space";

/** Cylinders, the larger ones with the distance to be kept. */
export class MovingObstacles {
  readonly group = new Group();
  private readonly parts: Group[];

  constructor(private readonly flight: Flight) {
    this.parts = flight.scene.moving.map(({ radius, height, safe }) => {
      const part = new Group();
      const red = colour("--discharged");
      const body = new CylinderGeometry(radius, radius, height, 40);
      const kept = new CylinderGeometry(radius + safe, radius + safe, height + 2 * safe, 40);
      part.add(
        new Mesh(body, glass(red, 0.7)),
        new LineSegments(new EdgesGeometry(body, 30), new LineBasicMaterial({ color: red })),
        new Mesh(kept, glass(red, 0.1)),
        new LineSegments(new EdgesGeometry(kept, 30), new LineBasicMaterial({ color: red })),
      );
      this.group.add(part);
      return part;
    });
  }

  draw(moment: Moment): void {
    this.parts.forEach((part, i) => {
      part.visible = this.flight.scene.moving[i].from <= moment.sample;
      part.position.copy(place(moment.moving[i]));
    });
  }
}

function glass(paint: string, opacity: number): MeshLambertMaterial {
  return new MeshLambertMaterial({ color: paint, transparent: true, opacity, depthWrite: false });
}
