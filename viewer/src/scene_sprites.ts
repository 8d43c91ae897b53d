// Small pictures that face the camera: waypoints, charge rings, violations, names.

import { CanvasTexture, Sprite, SpriteMaterial, SRGBColorSpace } from "three";

const PX = 128;

/** A picture drawn on a square of 128 pixels, as a texture. */
export function drawn(paint: (pen: CanvasRenderingContext2D, px: number) => void): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = PX;
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  redraw(texture, paint);
  return texture;
}

export function redraw(
  texture: CanvasTexture,
  paint: (pen: CanvasRenderingContext2D, px: number) => void,
): void {
  const pen = (texture.image as HTMLCanvasElement).getContext("2d")!;
  pen.clearRect(0, 0, PX, PX);
  paint(pen, PX);
  texture.needsUpdate = true;
}

/** A sprite of fixed size on the screen, in front of everything. */
export function badge(map: CanvasTexture): Sprite {
  const material = new SpriteMaterial({
    map,
    sizeAttenuation: false,
    depthTest: false,
    depthWrite: false,
  });
  const sprite = new Sprite(material);
  sprite.renderOrder = 10;
  return sprite;
}
