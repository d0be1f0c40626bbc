// On every page: the current screen is in view, also where the navigation is wider than a phone.

document.querySelector("nav [aria-current]")?.scrollIntoView({ inline: "center", block: "nearest" });
