"""Who measured what, and through whom it is quoted where it was not read there."""

YANG = (
    "Yang et al. (2023), Lubricants 11, 370, doi:10.3390/lubricants11090370: 110 000 points of the "
    "Beijing 2022 games in bins of 0.1 m/s"
)
LI = "Li et al. (2022), Lubricants 10, 265, doi:10.3390/lubricants10100265 (abstract)"
JENSEN = (
    "Jensen & Shegelski (2004), Can. J. Phys. 82, 791, arXiv:2112.09835: one of their shots, as "
    "quoted by Penner"
)
CURLTECH = "CurlTech, Timing rocks (curltech.com/curling-training/timing-rocks)"
CURLING_SCHOOL = "Curling School, Timing rocks (curlingschool.com/timingRocks.html)"
BRUSHERS = "Performance Brush, Timing rocks (performancebrush.com), a coach's rule of thumb"
DZIKOWSKI = "Dzikowski et al. (2022), Sensors 22, 1074, doi:10.3390/s22031074"
NYBERG = "Nyberg et al. (2013), Wear 301, 583"
TYSOE = "Tysoe & Spencer, Tribology & Lubrication Technology, August 2013, on Nyberg et al."
MURATA = "Murata (2022), Sci. Rep. 12, 15047, doi:10.1038/s41598-022-19303-4 (abstract)"
WATCHES = "coaches' tables of hog-to-hog times, as collected in the timing pages of clubs"
JENKYN = (
    "University of Western Ontario (Jenkyn), as told by Toronto's Pride curling league: 6 to 7 "
    "feet over the last third by top sweepers"
)
MARMO = "Marmo et al. (2006), as quoted in the literature on simulators"
LEVEL = "ice makers' levelling, as quoted in the project's issue; the first source was not found"
KAMEDA = "Kameda et al. (2024), as quoted; the paper itself was not read"
DIGITAL_CURLING = "Digital Curling 3's simulator FCV1 and its server's stones (its source code)"
CODES = (
    "jCurl 0.5 and no loss; Digital Curling 0.2 and 1.0; other public simulators 0.5 to 0.98: "
    "choices, no measurements"
)
RULE_BOOK = "championship practice of ice makers: four feet, half a foot more or less"
CLOSED_FORM = "closed form"
PAPER = "Estimation of Curling Sheet Friction Factor by Pixelization, tables 3 and 4"
