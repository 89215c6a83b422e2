#!/usr/bin/env bash
# Cuts the report's two font files down to the characters that a figure may use.
#
# usage: scripts/subset-font.sh            (from anywhere; needs npm and fonttools: `pip install fonttools==4.68.0`)
#
# The figures embed Inter (SIL Open Font License 1.1), so that a PNG looks the same on every machine. The whole
# family would add 700 kB to the program; these characters need 25 kB per weight. The layout features (kerning,
# ligatures) go too: without them a text is exactly as wide as the sum of its advances, which is how the chart
# module measures it. Add a character to the list below and run the script again to let figures use it.
set -euo pipefail

package='@expo-google-fonts/inter@0.4.2'
latin='U+0020-007E,U+00A0-00AC,U+00AE-00FF'
symbols='–—‘’“”•…′×÷±−≤≥≠≈∞√→μρΔνησλτ⁰⁴⁵⁶⁷⁸⁹⁻'

fonts="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/src/report/fonts"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

(cd "$scratch" && npm pack --silent "$package" && tar xzf ./*.tgz)

subset() {
  pyftsubset "$scratch/package/$1" --output-file="$fonts/$2" --unicodes="$latin" --text="$symbols" \
    --layout-features='' --no-hinting --desubroutinize --name-IDs='0,1,2,3,4,5,6,13,14' --notdef-outline
}

mkdir -p "$fonts"
subset 400Regular/Inter_400Regular.ttf Inter-Regular.ttf
subset 700Bold/Inter_700Bold.ttf Inter-Bold.ttf
cp "$scratch/package/LICENSE_FONT" "$fonts/OFL.txt"
