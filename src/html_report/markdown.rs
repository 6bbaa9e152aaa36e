//! Pages that commands write as Markdown, as sections: headings, tables, paragraphs and code, which is all
//! that they use. Pictures are left out, for a page has its own.

use report_page::{Block, Cell, Section, Table};

/// The sections of a text, one for each second heading; what stands before the first is the first one.
pub(super) fn sections(text: &str, ids: &[&'static str], opening: &str) -> Vec<Section> {
    let mut ids = ids.iter().copied();
    let mut sections = vec![Section::new(ids.next().unwrap_or("part"), opening)];
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if let Some(title) = line.strip_prefix("## ") {
            sections.push(Section::new(ids.next().unwrap_or("part"), &plain(title)));
            continue;
        }
        let Some(section) = sections.last_mut() else { break };
        if line.starts_with("```") {
            let code: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with("```")).collect();
            section.blocks.push(Block::Code("Text".to_owned(), code.join("\n")));
        } else if line.starts_with('|') {
            let mut table = Table { headings: cells(line), ..Table::default() };
            while let Some(row) = lines.next_if(|line| line.starts_with('|')) {
                let row = cells(row);
                if !row.iter().all(|cell| cell.chars().all(|c| c == '-' || c == ':')) {
                    table.row(row.into_iter().map(cell));
                }
            }
            section.blocks.push(Block::Table(table));
        } else if !line.trim().is_empty() && !line.starts_with("# ") && !line.starts_with("![") {
            section.blocks.push(Block::Text(plain(line.trim_start_matches(['#', ' ']))));
        }
    }
    sections.retain(|section| !section.blocks.is_empty());
    sections
}

/// A number stands at the right edge of its column.
fn cell(text: String) -> Cell {
    let first = text.trim_start_matches(['-', '+', '−']).chars().next();
    let is_number = text == "–" || first.is_some_and(|c| c.is_ascii_digit()) && !text.contains(' ');
    if is_number { Cell::number(text) } else { Cell::text(text) }
}

fn cells(row: &str) -> Vec<String> {
    let inside = row.trim().trim_start_matches('|').trim_end_matches('|').replace("\\|", "\u{0}");
    inside.split('|').map(|cell| plain(&cell.replace('\u{0}', "|"))).collect()
}

/// Text without the marks of emphasis and code.
fn plain(text: &str) -> String {
    text.trim().replace("**", "").replace(['`', '*'], "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_tables_code_and_paragraphs_are_found_and_pictures_left_out() {
        let text = "# Title\n\nFirst *words*.\n\n## Second\n\n| a | b |\n| --- | --- |\n| x \\| y | -1.5 |\n\n![alt](x.svg)\n\n```toml\na = 1\n```\n";
        let sections = sections(text, &["first", "second"], "Summary");
        assert_eq!(sections.iter().map(|section| section.title.as_str()).collect::<Vec<_>>(), ["Summary", "Second"]);
        assert_eq!(sections[0].blocks, [Block::Text("First words.".to_owned())]);
        let Block::Table(table) = &sections[1].blocks[0] else { panic!("no table: {:?}", sections[1]) };
        assert_eq!(table.headings, ["a", "b"]);
        assert_eq!(table.rows, [vec![Cell::text("x | y"), Cell::number("-1.5")]]);
        assert_eq!(sections[1].blocks[1], Block::Code("Text".to_owned(), "a = 1".to_owned()));
        assert_eq!(sections[1].blocks.len(), 2);
    }
}
