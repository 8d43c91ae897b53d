// The ground that cameras have seen, as sheets that lie on the ground of the 3D scene.

import { CanvasTexture, Group, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace } from "three";
import type { Flight, Moment } from "./flight";
import type { Extent } from "./scene_terrain";
import { SEEN_ALPHA, type SeenSheet, sheets } from "./seen";

export class SeenGround {
  readonly group = new Group();
  private readonly laid: { sheet: SeenSheet; texture: CanvasTexture }[];

  constructor(flight: Flight, { corners, ground, half }: Extent) {
    const [west, east] = [Math.min, Math.max].map((pick) => pick(...corners.map(({ x }) => x)));
    const [north, south] = [Math.min, Math.max].map((pick) => pick(...corners.map(({ z }) => z)));
    this.laid = sheets(flight).map((sheet, n) => {
      const texture = new CanvasTexture(sheet.canvas);
      texture.colorSpace = SRGBColorSpace;
      const mesh = new Mesh(
        new PlaneGeometry(east - west, south - north),
        new MeshBasicMaterial({ map: texture, transparent: true, opacity: SEEN_ALPHA, depthWrite: false }),
      );
      mesh.rotation.x = -Math.PI / 2;
      // above the layers of the terrain, each above the other
      mesh.position.set((west + east) / 2, ground + (4 + n) * 6e-4 * half, (north + south) / 2);
      mesh.renderOrder = -1;
      this.group.add(mesh);
      return { sheet, texture };
    });
  }

  draw(moment: Moment): void {
    for (const { sheet, texture } of this.laid) if (sheet.until(moment.sample)) texture.needsUpdate = true;
  }

  dispose(): void {
    for (const { texture } of this.laid) texture.dispose();
  }
}
