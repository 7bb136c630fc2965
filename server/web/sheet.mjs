// Canvases as sharp as the screen: their pixels follow their size on the page.

/** Most pixels of a canvas for a CSS pixel, each way. */
const MOST = 2;

/** Gives a canvas as many pixels as the screen has where it is shown; how many for a CSS pixel, 0 while it is not shown. */
export function fit(canvas) {
  const ratio = Math.min(MOST, window.devicePixelRatio || 1);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((px) => Math.round(px * ratio));
  if (width === 0 || height === 0) return 0;
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  return ratio;
}

/** A canvas to draw on anew: its context, empty, and its width and height, all in CSS pixels; null while it is not shown. */
export function sheetOf(canvas) {
  const ratio = fit(canvas);
  if (ratio === 0) return null;
  const context = canvas.getContext('2d');
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
