//! Aligned tables for the terminal.

/// Rows of text under a heading; numbers are right-aligned.
#[derive(Debug)]
pub(crate) struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn new<S: Into<String>>(heading: impl IntoIterator<Item = S>) -> Self {
        Self { rows: vec![heading.into_iter().map(Into::into).collect()] }
    }

    pub(crate) fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rows.len() < 2
    }

    /// The cells of each row by their headings, for programs.
    pub(crate) fn to_json(&self) -> serde_json::Value {
        let cells = |row: &Vec<String>| -> serde_json::Map<String, serde_json::Value> {
            self.rows[0].iter().cloned().zip(row.iter().map(|cell| cell.as_str().into())).collect()
        };
        self.rows[1..].iter().map(|row| serde_json::Value::Object(cells(row))).collect()
    }

    /// The table with a rule below the heading, without a final line break.
    pub(crate) fn to_text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        let width = |column| self.rows.iter().map(|row| cell(row, column).chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let is_number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit() || "-+<–∞".contains(c));
        let numeric: Vec<bool> =
            (0..columns).map(|c| self.rows[1..].iter().all(|row| is_number(&cell(row, c)))).collect();
        let line = |row: &Vec<String>| {
            let cells: Vec<String> = (0..columns)
                .map(|c| {
                    let padding = " ".repeat(widths[c] - cell(row, c).chars().count());
                    if numeric[c] {
                        format!("{padding}{}", cell(row, c))
                    } else {
                        format!("{}{padding}", cell(row, c))
                    }
                })
                .collect();
            cells.join("  ").trim_end().to_string()
        };
        let mut lines: Vec<String> = self.rows.iter().map(line).collect();
        lines.insert(1, "─".repeat(widths.iter().sum::<usize>() + 2 * columns.saturating_sub(1)));
        lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_left_and_numbers_right() {
        let mut table = Table::new(["scene", "Mrays/s"]);
        table.row(["bunny", "26.6"]);
        table.row(["car", "9.1"]);
        assert_eq!(table.to_text(), "scene  Mrays/s\n──────────────\nbunny     26.6\ncar        9.1");
    }
}
