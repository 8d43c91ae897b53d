// What changes or stands on the map besides vehicles: waypoints, moving obstacles, violations.

import {
  BufferGeometry,
  CanvasTexture,
  CylinderGeometry,
  EdgesGeometry,
  Float32BufferAttribute,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshLambertMaterial,
  Sprite,
  SpriteMaterial,
} from "three";
import type { Flight, Moment } from "./flight";
import { cross, noReturn, waypoint, words } from "./marks";
import { colour } from "./palette";
import { badge, drawn } from "./scene_sprites";
import { place } from "./scene_space";

export class Waypoints {
  readonly group = new Group();
  private readonly sprites: { sprite: Sprite; open: CanvasTexture; covered: CanvasTexture }[];

  constructor(private readonly flight: Flight, ground: number) {
    const textures = [false, true].map((heavy) =>
      [false, true].map((covered) =>
        drawn((pen, px) => waypoint(pen, px / 2, px / 2, px / 2 - 4, 3, heavy, covered)),
      ),
    );
    const stalks: number[] = [];
    this.sprites = flight.scene.waypoints.map(({ at, radius, heavy }) => {
      const [open, covered] = textures[Number(heavy)];
      const sprite = new Sprite(new SpriteMaterial({ map: open, depthWrite: false }));
      sprite.position.copy(place(at));
      // the ring lies 4 of 128 pixels within the picture
      sprite.scale.setScalar((2 * radius * 128) / 120);
      const { x, y, z } = sprite.position;
      stalks.push(x, y, z, x, ground, z);
      this.group.add(sprite);
      return { sprite, open, covered };
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(stalks, 3));
    const faint = new LineBasicMaterial({
      color: colour("--open"),
      transparent: true,
      opacity: 0.25,
    });
    this.group.add(new LineSegments(geometry, faint));
  }

  draw(moment: Moment): void {
    this.sprites.forEach(({ sprite, open, covered }, i) => {
      sprite.material.map = this.flight.data.covered_at[i] <= moment.sample ? covered : open;
    });
  }
}

/** Cylinders, the larger ones with the distance to be kept. */
export class MovingObstacles {
  readonly group = new Group();
  private readonly parts: Group[];

  constructor(flight: Flight) {
    this.parts = flight.scene.moving.map(({ name, kind, radius, height, safe }) => {
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
      const label = badge(drawn((pen, px) => caption(pen, px, kind || name)));
      label.name = "label";
      label.position.y = height / 2;
      part.add(label);
      this.group.add(part);
      return part;
    });
  }

  draw(moment: Moment, pixel: number): void {
    this.parts.forEach((part, i) => {
      part.position.copy(place(moment.moving[i]));
      part.getObjectByName("label")!.scale.setScalar(118 * pixel);
    });
  }
}

/** Crosses where a contact happened; pale until it does. */
export class Violations {
  readonly group = new Group();
  private readonly marks: { sprite: Sprite; time: number }[];

  constructor(flight: Flight) {
    const texture = drawn((pen, px) => {
      cross(pen, px / 2, px / 2, 0.17 * px);
      pen.lineWidth = 0.05 * px;
      pen.strokeStyle = colour("--discharged");
      pen.beginPath();
      pen.arc(px / 2, px / 2, 0.36 * px, 0, 2 * Math.PI);
      pen.stroke();
    });
    this.marks = flight.data.violations.map((violation) => {
      const sprite = badge(texture);
      sprite.position.copy(place(flight.where(violation)));
      this.group.add(sprite);
      return { sprite, time: violation.t_s };
    });
  }

  draw(moment: Moment, pixel: number): void {
    for (const { sprite, time } of this.marks) {
      sprite.scale.setScalar(60 * pixel);
      sprite.material.opacity = time <= moment.time + 1e-6 ? 1 : 0.35;
    }
  }
}

/** Diamonds at the points of no return, or where least charge was left beyond the way home. */
export class NoReturns {
  readonly group = new Group();
  private readonly marks: { sprite: Sprite; sample: number }[];

  constructor(private readonly flight: Flight) {
    this.marks = flight.scene.uas.map((uas, i) => {
      const passed = flight.data.no_return[i] !== null;
      const sample = flight.data.no_return[i] ?? flight.data.least_spare[i][0];
      const sprite = badge(drawn((pen, px) => noReturn(pen, px / 2, px / 2, 0.3 * px, passed, uas.colour)));
      sprite.position.copy(place(flight.position(sample, i)));
      this.group.add(sprite);
      return { sprite, sample };
    });
  }

  draw(moment: Moment, pixel: number, followed: number | null): void {
    this.marks.forEach(({ sprite, sample }, i) => {
      sprite.visible = this.flight.nearNoReturn(i, followed);
      sprite.scale.setScalar(26 * pixel);
      sprite.material.opacity = sample <= moment.sample ? 1 : 0.35;
    });
  }
}

/** A name, a word to a line, above the middle of a small picture. */
function caption(pen: CanvasRenderingContext2D, px: number, name: string): void {
  const lines = name.split(/[_\s]+/).slice(0, 3);
  lines.forEach((line, i) => {
    const size = Math.min(0.13, 1.5 / Math.max(1, line.length)) * px;
    const y = 0.42 * px - 0.15 * px * (lines.length - 1 - i);
    words(pen, line, px / 2, y, size, colour("--ink"));
  });
}

function glass(paint: string, opacity: number): MeshLambertMaterial {
  return new MeshLambertMaterial({ color: paint, transparent: true, opacity, depthWrite: false });
}
