//! Texts that come from files of others, fitted to the embedded font.

use super::{BarPanel, Figure, Panel, XyPanel, missing_glyphs};

impl Figure {
    /// The figure with `?` for each letter that the embedded font lacks, since a machine's or an experiment's name may be
    /// written in any script. The pages beside it have the name as it is.
    pub fn legible(mut self) -> Figure {
        self.change_texts(&mut |text| {
            let missing = missing_glyphs(text);
            let drawn = |letter: char| match letter {
                _ if !missing.contains(&letter) => letter,
                _ if letter.is_whitespace() => ' ',
                _ => '?',
            };
            *text = text.chars().map(drawn).collect();
        });
        self
    }

    /// Passes every text that the picture shows.
    pub(super) fn change_texts(&mut self, change: &mut dyn FnMut(&mut String)) {
        change(&mut self.title);
        self.note.iter_mut().for_each(&mut *change);
        for panel in &mut self.panels {
            match panel {
                Panel::Xy(panel) => panel.change_texts(change),
                Panel::Bars(panel) => panel.change_texts(change),
            }
        }
    }
}

impl XyPanel {
    fn change_texts(&mut self, change: &mut dyn FnMut(&mut String)) {
        change(&mut self.title);
        for axis in [&mut self.x, &mut self.y] {
            change(&mut axis.label);
            axis.ticks.iter_mut().flatten().for_each(|(_, label)| change(label));
        }
        for series in &mut self.series {
            change(&mut series.label);
            series.points.iter_mut().filter_map(|point| point.label.as_mut()).for_each(&mut *change);
        }
        self.marks.iter_mut().for_each(|mark| change(&mut mark.label));
        self.bands.iter_mut().for_each(|band| change(&mut band.label));
    }
}

impl BarPanel {
    fn change_texts(&mut self, change: &mut dyn FnMut(&mut String)) {
        change(&mut self.title);
        change(&mut self.y_label);
        self.segments.iter_mut().for_each(&mut *change);
        for group in &mut self.groups {
            change(&mut group.label);
            group.bars.iter_mut().for_each(|bar| change(&mut bar.label));
        }
    }
}
