//! The embedded font: widths of texts, so that a layout can leave room for them, and line breaks.

use ttf_parser::Face;

/// What a browser tries in turn. The first is what the PNG is drawn with.
pub(crate) const FAMILIES: &str = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif";

/// A weight of the font.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Weight {
    Regular,
    Bold,
}

/// DejaVu Sans, regular and bold.
pub(crate) struct Font {
    regular: Face<'static>,
    bold: Face<'static>,
}

impl Font {
    /// The font that is part of the program.
    pub(crate) fn embedded() -> Self {
        let read = |bytes| Face::parse(bytes, 0).expect("the embedded font is readable, which a test checks");
        Self { regular: read(dejavu::sans::regular()), bold: read(dejavu::sans::bold()) }
    }

    fn face(&self, weight: Weight) -> &Face<'static> {
        match weight {
            Weight::Regular => &self.regular,
            Weight::Bold => &self.bold,
        }
    }

    /// The width of a text, the sum of its characters' advances (kerning makes it at most narrower by a pixel
    /// or two).
    pub(crate) fn width_px(&self, text: &str, size_px: f64, weight: Weight) -> f64 {
        let face = self.face(weight);
        let em = f64::from(face.units_per_em());
        let advance =
            |c: char| face.glyph_index(c).and_then(|glyph| face.glyph_hor_advance(glyph)).map_or(em, f64::from);
        text.chars().map(advance).sum::<f64>() * size_px / em
    }

    /// The first character of a text that the font lacks.
    pub(crate) fn missing(&self, text: &str) -> Option<char> {
        text.chars()
            .find(|&c| c.is_control() || [&self.regular, &self.bold].iter().any(|face| face.glyph_index(c).is_none()))
    }

    /// A text broken at spaces into lines of at most `width_px`; a longer word stays whole.
    pub(crate) fn wrap(&self, text: &str, size_px: f64, weight: Weight, width_px: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace() {
            match lines.last_mut() {
                Some(line) if self.width_px(&format!("{line} {word}"), size_px, weight) <= width_px => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }

    /// `size_px`, or the smaller size at which a text is at most `room_px` wide.
    pub(crate) fn fitting_px(&self, text: &str, size_px: f64, weight: Weight, room_px: f64) -> f64 {
        let width_px = self.width_px(text, size_px, weight);
        if width_px > room_px { size_px * room_px / width_px } else { size_px }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Advances of DejaVu Sans 2.37 in 1/2048 em (its `hmtx` table): A 1401, i 569. A fallback width of one
    /// em would be 2 × 20.48 px.
    #[test]
    fn golden_widths_of_the_embedded_font() {
        let font = Font::embedded();
        let width_px = font.width_px("Ai", 20.48, Weight::Regular);
        assert!((width_px - 19.70).abs() < 0.011, "{width_px}");
        assert!(font.width_px("Ai", 20.48, Weight::Bold) > width_px);
    }

    #[test]
    fn what_reports_need_has_glyphs_and_a_line_break_has_none() {
        let font = Font::embedded();
        assert_eq!(font.missing("σ̂θ² ±×−·∞≤≥→√½°µm 10⁻¹²"), None);
        assert_eq!(font.missing("two\nlines"), Some('\n'));
        assert_eq!(font.missing("距"), Some('距'));
    }

    #[test]
    fn lines_are_broken_between_words_and_no_word_is_lost() {
        let font = Font::embedded();
        let text = "scenario paper.toml, seed 7, incomprehensibilities";
        let lines = font.wrap(text, 12.0, Weight::Regular, 100.0);
        assert!(lines.len() >= 3);
        assert_eq!(lines.join(" "), text);
        for line in lines.iter().filter(|line| line.contains(' ')) {
            assert!(font.width_px(line, 12.0, Weight::Regular) <= 100.0);
        }
        let px = font.fitting_px(text, 12.0, Weight::Regular, 100.0);
        assert!((font.width_px(text, px, Weight::Regular) - 100.0).abs() < 0.1);
    }
}
