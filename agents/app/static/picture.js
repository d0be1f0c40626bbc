// A picture of the page as a PNG, with its colours as they are seen.

const KEPT = ["fill", "fill-opacity", "stroke", "stroke-opacity", "stroke-width", "stroke-dasharray", "opacity", "visibility", "transform", "vector-effect", "stroke-linecap"];
const WIDTH = 1200, WORDS = 64; // of the picture, and of the line below it [px]

/** Make a PNG of an SVG element, with a line of words below it. */
export async function pictureOf(svg, words) {
  const copy = svg.cloneNode(true), from = [...svg.querySelectorAll("*")];
  [...copy.querySelectorAll("*")].forEach((one, k) => {
    const seen = getComputedStyle(from[k]);
    for (const name of KEPT) one.style.setProperty(name, seen.getPropertyValue(name));
  });
  const box = svg.getBoundingClientRect(), height = Math.round(WIDTH * box.height / box.width);
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", WIDTH);
  copy.setAttribute("height", height);
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  await image.decode();
  const canvas = Object.assign(document.createElement("canvas"), { width: WIDTH, height: height + WORDS }), paper = canvas.getContext("2d");
  const page = getComputedStyle(document.body);
  paper.fillStyle = page.backgroundColor;
  paper.fillRect(0, 0, canvas.width, canvas.height);
  paper.drawImage(image, 0, 0);
  paper.fillStyle = page.color;
  paper.font = `26px ${page.fontFamily}`;
  paper.fillText(words, 16, height + 42, WIDTH - 32);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}
