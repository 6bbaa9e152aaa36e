//! The table of contents: one file a method.

use crate::estimate::Method;

/// Declares the methods: module and type of each.
macro_rules! contents {
    ($($module:ident :: $Type:ident),* $(,)?) => {
        $(pub mod $module;)*

        /// Every method, in the order in which tables show them.
        pub static METHODS: &[&dyn Method] = &[$(&$module::$Type::DEFAULT),*];

        #[cfg(test)]
        const FILES: &[&str] = &[$(stringify!($module)),*];
    };
}

contents! {
    joint::Joint,
    direct::Direct,
    umbmark::Umbmark,
    jung_chung::JungChung,
    circular::Circular,
    ivanjko::Ivanjko,
    linear::Linear,
    tachometer::Tachometer,
    censi::Censi,
    segments::Segments,
    augmented_kalman::AugmentedKalman,
}

/// A method by name.
#[must_use]
pub fn method(name: &str) -> Option<&'static dyn Method> {
    METHODS.iter().copied().find(|method| method.name() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folder_list_and_names_agree() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/methods");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .expect("the methods stand beside this file")
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().trim_end_matches(".rs").to_owned())
            .filter(|file| file != "mod")
            .collect();
        files.sort();
        let mut list = FILES.to_vec();
        list.sort_unstable();
        assert_eq!(files, list);
        let names: Vec<_> = METHODS.iter().map(|method| method.name()).collect();
        assert_eq!(names, FILES);
        assert!(method("direct").is_some() && method("no such").is_none());
    }
}
