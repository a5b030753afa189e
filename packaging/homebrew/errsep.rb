# The program for Homebrew, built from a clone of this repository, which HOMEBREW_ERRSEP_CLONE names:
#
#     brew tap-new local/errsep
#     cp packaging/homebrew/errsep.rb "$(brew --repository local/errsep)/Formula/"
#     HOMEBREW_ERRSEP_CLONE=$PWD brew install --HEAD local/errsep/errsep
class Errsep < Formula
  desc "Separates machine tool errors from those of artefact, sensors and set-up"
  license any_of: ["MIT", "Apache-2.0"]
  head "file://#{ENV.fetch("HOMEBREW_ERRSEP_CLONE", Dir.pwd)}", using: :git, branch: "main"

  depends_on "rust" => :build

  def install
    system "cargo", "install", "--bin", "errsep", "--features", "parquet", *std_cargo_args
    generate_completions_from_executable(bin/"errsep", "completions")
    system bin/"errsep", "man", man1
  end

  test do
    system bin/"errsep", "simulate", "circle", "--out", "made"
    assert_match "radius", shell_output("#{bin}/errsep circle made/points.csv")
  end
end
