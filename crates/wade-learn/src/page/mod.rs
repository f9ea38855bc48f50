//! A report as one HTML page that needs no other file: its frame, its look, plain tables and figures.

pub mod plot;

pub use plot::PlotError;

/// The look of every page.
const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1340px;margin:24px auto;padding:0 10px;color:#1f2328;overflow-wrap:anywhere}\
h1{font-size:22px;margin:0 0 4px}h2{font-size:18px;margin:30px 0 4px}h3{font-size:15px;margin:18px 0 2px}p{margin:4px 0 8px}\
.verdict{padding:10px 14px;border-left:6px solid #1d5fb0;background:#eef4fb;margin:12px 0}.verdict ul{margin:4px 0;padding-left:20px}\
.pass{border-color:#2a8c4a;background:#eef8f0}.fail{border-color:#b91c1c;background:#fdf0f0}\
.notice{border-color:#d97a06;background:#fdf6ec}\
.wide{overflow-x:auto;max-width:100%}table{display:block;overflow-x:auto;max-width:100%;border-collapse:collapse;margin:8px 0}\
th,td{padding:3px 9px;border-bottom:1px solid #e3e6ea;text-align:right;white-space:nowrap;overflow-wrap:normal}th{white-space:normal;vertical-align:bottom}\
th:first-child,td:first-child{text-align:left;padding-left:0}.text{text-align:left;white-space:normal;min-width:14em}\
td.paper,th.paper{color:#8a5a00;background:#fdf9f1}td.none{background:#fdf0f0}\
figure{display:inline-block;max-width:100%;margin:0 6px 6px 0}.legend span{display:inline-block;margin-right:18px}\
.bar{display:flex;height:22px;border-radius:4px;overflow:hidden;margin:8px 0 4px}\
.legend i{display:inline-block;width:9px;height:9px;border-radius:5px;margin-right:6px}.legend i.dash{width:18px;height:0;border-top:2px dashed #000;border-radius:0;vertical-align:middle}\
.small{color:#57606a;font-size:13px}svg{max-width:100%;height:auto;display:block}pre{font-size:13px;overflow-x:auto}";

/// A page of a title, which is plain text, and a body, which is HTML.
pub fn document(title: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <meta name=\"viewport\" content=\"width=device-width\"><style>{STYLE}</style></head><body>\n\
         <h1>{title}</h1>\n{body}\n</body></html>\n"
    )
}

/// Plain text as HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Plain text that keeps its lines, as HTML.
pub fn preformatted(text: &str) -> String {
    format!("<pre>{}</pre>\n", escape(text))
}

/// A table of cells that are HTML; the columns from `paper` on are the source paper's and look different.
pub fn table<S: AsRef<str>>(
    heads: &[S],
    paper: usize,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> String {
    let class = |column: usize| if column >= paper { " class=\"paper\"" } else { "" };
    let line = |tag: &str, cells: &mut dyn Iterator<Item = &str>| {
        let cell = |(column, cell): (usize, &str)| format!("<{tag}{}>{cell}</{tag}>", class(column));
        format!("<tr>{}</tr>\n", cells.enumerate().map(cell).collect::<String>())
    };
    let head = line("th", &mut heads.iter().map(AsRef::as_ref));
    let body: String = rows.into_iter().map(|row| line("td", &mut row.iter().map(String::as_str))).collect();
    format!("<div class=\"wide\"><table>{head}{body}</table></div>\n")
}
