// Small pictures: signs on the ground, dots.

import { CanvasTexture, SRGBColorSpace } from "three";

const PX = 128;

/** A picture drawn on a square of 128 pixels, as a texture. */
export function drawn(paint: (pen: CanvasRenderingContext2D, px: number) => void): CanvasTexture {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = PX;
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  paint(canvas.getContext("2d")!, PX);
  return texture;
}
