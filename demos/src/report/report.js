const images = [...document.querySelectorAll("img.image")];
const slider = document.querySelector(".slider");
if (slider && images.length > 1) {
  const find = (name) => slider.querySelector(name);
  const show = (side, target) => { find(target).src = images[find(side).value].src; };
  find(".left").onchange = () => show(".left", ".over");
  find(".right").onchange = () => show(".right", ".under");
  find("input").oninput = (e) => find(".stage").style.setProperty("--at", e.target.value + "%");
  show(".left", ".over");
  show(".right", ".under");
  slider.hidden = false;
}
